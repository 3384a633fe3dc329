//! Watches and replicas are told of keep-outs.

use super::{ball, client_of, map, name, put, started};

use mrol::client::{Replica, ReplicaOptions};
use mrol::map::{KeepOutAct, KeepOutChange, Lookup, Region};
use mrol::service::{
    Cause, DeleteKeepOut, PointQuery, WatchEvent, WatchForm, WatchMessage, WatchRequest, WatchedSince,
};

use crate::support::daemon::{Daemon, PATIENCE, row};
use crate::support::map_folders::copy_folder;

#[tokio::test]
async fn who_watches_is_told_of_keep_outs_in_both_forms_and_from_the_journal() {
    let daemon = Daemon::start_with(|config| config.store.watch_bytes_max = 1).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(3)).await;
    let client = client_of(&daemon).await;
    client.put_keep_out(&map("a"), put("dock", ball([0.0; 3], 1.0))).await.unwrap();
    let removal = DeleteKeepOut { name: name("dock"), request_id: None };
    client.put_keep_out(&map("a"), put("spill", ball([1.0; 3], 2.0))).await.unwrap();
    client.delete_keep_out(&map("a"), removal).await.unwrap();
    let map_uuid = client.map_info(&map("a")).await.unwrap().version.map_uuid;
    // The ring has room for none of them: what came since is read from the journal.
    let since = Some(WatchedSince { revision: 1, map_uuid, content_hash: None, state_hash: None });
    let mut told = client.watch(&map("a"), WatchRequest { since, ..WatchRequest::default() }).await.unwrap();
    let mut causes = Vec::new();
    while causes.len() < 3 {
        if let WatchEvent::Change(part) = told.next().await.unwrap().unwrap().event {
            assert!(part.is_last && part.removed.is_empty() && part.added.is_empty());
            causes.push(part.cause);
        }
    }
    let of = |text: &str, act| Cause::KeepOut(KeepOutChange { name: name(text), act });
    let made = |shape| KeepOutAct::Put { shape, made_by: None, expires_at_ns: None };
    let expected = [
        of("dock", made(ball([0.0; 3], 1.0))),
        of("spill", made(ball([1.0; 3], 2.0))),
        of("dock", KeepOutAct::Removed { by: None }),
    ];
    assert_eq!(causes, expected);
    // The whole state has them, in its first part.
    for form in [WatchForm::Changes, WatchForm::Deltas { level: 1 }] {
        let mut told =
            client.watch(&map("a"), WatchRequest { form, ..WatchRequest::default() }).await.unwrap();
        let WatchEvent::State(state) = told.next().await.unwrap().unwrap().event else { panic!("no state") };
        assert_eq!(state.keep_outs, client.list_keep_outs(&map("a")).await.unwrap().keep_outs);
    }
}

#[tokio::test]
async fn who_watches_deltas_is_told_of_keep_outs_as_they_come() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    let region = Some(Region::ball([9.0; 3], 0.1).unwrap());
    let request = WatchRequest { form: WatchForm::Deltas { level: 2 }, region, ..WatchRequest::default() };
    let mut told = client.watch(&map("a"), request).await.unwrap();
    told.next().await.unwrap().unwrap();
    client.put_keep_out(&map("a"), put("dock", ball([0.0; 3], 1.0))).await.unwrap();
    let WatchEvent::Change(part) = told.next().await.unwrap().unwrap().event else { panic!("no change") };
    assert!(part.revision == 2 && matches!(part.cause, Cause::KeepOut(_)) && part.content_hash.is_some());
}

#[tokio::test]
async fn a_replica_follows_keep_outs_and_regards_them_as_the_server_does() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    client.put_keep_out(&map("a"), put("dock", ball([3.0, 0.0, 0.0], 0.5))).await.unwrap();
    let replica = Replica::open(client.clone(), map("a"), ReplicaOptions::default()).await.unwrap();
    let points: Vec<_> = (-70..70).map(|i| [i as f32 * 0.1 + 0.05, 0.05, 0.05].into()).collect();
    let agree = async |revision: u64| {
        replica.wait_for_revision(revision, PATIENCE).await.unwrap();
        for keep_out in [false, true] {
            let query = PointQuery {
                points: points.clone().into(),
                map_from_points: None,
                level: 0,
                lookup: Lookup::Exact,
                min_revision: Some(revision),
                map_uuid: None,
                keep_out,
            };
            let own = replica.query_points(&query).unwrap();
            assert_eq!(own, client.query_points(&map("a"), query).await.unwrap());
        }
        let of_server = client.list_keep_outs(&map("a")).await.unwrap().keep_outs;
        assert!(replica.map().keep_outs().iter().eq(&of_server));
    };
    agree(2).await;
    client.put_keep_out(&map("a"), put("spill", ball([-3.0, 0.0, 0.0], 1.5))).await.unwrap();
    agree(3).await;
    daemon.put_in("a", &row(30)).await;
    client.put_keep_out(&map("a"), put("dock", ball([6.0, 0.0, 0.0], 0.5))).await.unwrap();
    agree(5).await;
    let removal = DeleteKeepOut { name: name("spill"), request_id: None };
    client.delete_keep_out(&map("a"), removal).await.unwrap();
    agree(6).await;
    assert_eq!(replica.status().resets, 1);
}

/// An older data folder is put back, and the map goes on with the scans that were lost, but with other keep-outs: it
/// has the uuid, the revision and the voxels that copies know.
#[tokio::test]
async fn a_copy_has_the_maps_keep_outs_after_an_older_data_folder_was_put_back() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    client.put_keep_out(&map("a"), put("dock", ball([3.0, 0.0, 0.0], 0.5))).await.unwrap();
    client.put_keep_out(&map("a"), put("stairs", ball([9.0, 0.0, 0.0], 0.5))).await.unwrap();
    let data = daemon.stop().await;
    let cold = tempfile::tempdir().unwrap();
    copy_folder(data.path(), cold.path());

    // What is lost: a keep-out that is put, one that is removed, and a scan.
    let daemon = Daemon::start_in(data, |_| {}).await;
    let (address, client) = (daemon.grpc, client_of(&daemon).await);
    client.put_keep_out(&map("a"), put("lost", ball([0.0; 3], 0.5))).await.unwrap();
    let removal = DeleteKeepOut { name: name("stairs"), request_id: None };
    client.delete_keep_out(&map("a"), removal).await.unwrap();
    daemon.put_in("a", &row(20)).await;
    let mut replicas = Vec::new();
    for region in [None, Some(Region::ball([1.0, 0.0, 0.0], 1.0).unwrap())] {
        let options = ReplicaOptions { region, ..ReplicaOptions::default() };
        replicas.push(Replica::open(client.clone(), map("a"), options).await.unwrap());
    }
    let mut told = client.watch(&map("a"), WatchRequest::default()).await.unwrap();
    let before = told.next().await.unwrap().unwrap();
    drop((told, daemon.stop().await));

    let daemon = Daemon::start_in(cold, |config| config.grpc.listen = address).await;
    let client = client_of(&daemon).await;
    client.put_keep_out(&map("a"), put("spill", ball([0.0, 3.0, 0.0], 0.5))).await.unwrap();
    client.put_keep_out(&map("a"), put("dock", ball([3.0, 0.0, 0.0], 1.5))).await.unwrap();
    daemon.put_in("a", &row(20)).await;
    daemon.put_in("a", &row(21)).await;
    for replica in &replicas {
        replica.wait_for_revision(7, PATIENCE).await.unwrap();
        let of_server = client.list_keep_outs(&map("a")).await.unwrap().keep_outs;
        let here: Vec<_> = replica.map().keep_outs().iter().cloned().collect();
        assert_eq!((here, replica.status().resets), (of_server, 2));
    }
    // The content hash alone does not tell it; the state hash does, whatever form is watched.
    let since_of = |message: &WatchMessage| match &message.event {
        WatchEvent::State(part) => WatchedSince {
            revision: part.version.revision,
            map_uuid: message.map_uuid,
            content_hash: Some(part.version.hash),
            state_hash: message.state_hash,
        },
        event => panic!("{event:?} is no state"),
    };
    let first = async |since: WatchedSince, form: WatchForm| {
        let request = WatchRequest { since: Some(since), form, ..WatchRequest::default() };
        client.watch(&map("a"), request).await.unwrap().next().await.unwrap().unwrap()
    };
    let lost = since_of(&before);
    assert!(lost.revision == 6 && lost.state_hash.is_some());
    let message = first(WatchedSince { state_hash: None, ..lost }, WatchForm::Changes).await;
    assert!(matches!(&message.event, WatchEvent::Change(part) if part.revision == 7), "{message:?}");
    for form in [WatchForm::Changes, WatchForm::Deltas { level: 0 }] {
        let state = first(lost, form).await;
        let here = since_of(&state);
        // Who has this history goes on in it, and hears with a heartbeat which hash that is.
        for state_hash in [here.state_hash, None] {
            let message = first(WatchedSince { state_hash, ..here }, form).await;
            assert_eq!((message.event, message.state_hash), (WatchEvent::Heartbeat, here.state_hash));
        }
    }
    // So it is after a restart, where the hash comes from what was read.
    let state = first(lost, WatchForm::Changes).await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    let request = WatchRequest { since: Some(since_of(&state)), ..WatchRequest::default() };
    let mut told = client_of(&daemon).await.watch(&map("a"), request).await.unwrap();
    assert_eq!(told.next().await.unwrap().unwrap().event, WatchEvent::Heartbeat);
}
