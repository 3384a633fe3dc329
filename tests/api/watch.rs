//! Watching a map: the state, every change as it becomes durable, and replicas that follow.

use std::collections::BTreeSet;
use std::time::Duration;

use mrol::bloom::FilterSettings;
use mrol::client::{Answers, Client, Replica, ReplicaOptions};
use mrol::map::{ContentHash, Lookup, MapName, Region, StateHash};
use mrol::service::{
    BlockBytes, Cause, PointQuery, WatchEvent, WatchForm, WatchMessage, WatchRequest, WatchedSince,
};
use mrol::store::{Durability, Snapshot};
use mrol::wire::pb;
use prost::Message;
use serde_json::{Value, json};
use uuid::Uuid;

use crate::support::daemon::{Daemon, PATIENCE, bytes_of, json_of, pose_json, row};
use crate::support::map_folders::copy_folder;
use crate::support::plain_set::{PlainSet, content_hash, up};

fn map(name: &str) -> MapName {
    MapName::new(name).unwrap()
}

async fn client_of(daemon: &Daemon) -> Client {
    Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap()
}

fn set_of(blocks: &BlockBytes) -> PlainSet {
    blocks.to_set().unwrap().iter().map(|voxel| voxel.index()).collect()
}

/// What a watcher has of a map.
#[derive(Default)]
struct Watcher {
    map_uuid: Uuid,
    revision: u64,
    hash: Option<u64>,
    state_hash: Option<StateHash>,
    voxels: PlainSet,
    resets: usize,
    /// It watches a region, of which there is no hash.
    is_part: bool,
    causes: Vec<Cause>,
}

impl Watcher {
    /// Takes a message; parts are applied as they come.
    fn take(&mut self, message: WatchMessage) {
        (self.map_uuid, self.state_hash) = (message.map_uuid, message.state_hash);
        match message.event {
            WatchEvent::Heartbeat => assert_eq!(message.head_revision, self.revision),
            WatchEvent::State(part) => {
                if part.is_first {
                    self.voxels.clear();
                    self.resets += 1;
                }
                self.voxels.extend(set_of(&part.voxels));
                (self.revision, self.hash) = (part.version.revision, Some(part.version.hash.to_bits()));
            }
            WatchEvent::Change(part) => {
                assert_eq!(part.revision, self.revision + 1, "revisions come without a gap");
                let (removed, added) = (set_of(&part.removed), set_of(&part.added));
                assert!(removed.is_disjoint(&added));
                self.voxels.retain(|voxel| !removed.contains(voxel));
                self.voxels.extend(added);
                if part.is_last {
                    self.revision = part.revision;
                    self.hash = part.content_hash.map(|hash| hash.to_bits());
                    self.causes.push(part.cause);
                }
            }
        }
    }

    /// Reads until `revision` is told, and compares the hash.
    async fn read_to(&mut self, messages: &mut Answers<WatchMessage>, revision: u64) {
        while self.revision < revision {
            let next = tokio::time::timeout(PATIENCE, messages.next()).await;
            self.take(next.expect("a message in time").expect("another message").unwrap());
            if let Some(hash) = self.hash.filter(|_| !self.is_part) {
                assert_eq!(hash, content_hash(&self.voxels), "at revision {}", self.revision);
            }
        }
    }

    fn since(&self) -> Option<WatchedSince> {
        let content_hash = self.hash.map(ContentHash::from_bits);
        let (revision, map_uuid, state_hash) = (self.revision, self.map_uuid, self.state_hash);
        Some(WatchedSince { revision, map_uuid, content_hash, state_hash })
    }
}

async fn revision_of(daemon: &Daemon, map: &str) -> u64 {
    json_of(daemon.get(&format!("/v1/maps/{map}")).await).await["revision"].as_u64().unwrap()
}

/// Scans, a deletion, and an undo of each kind: six revisions.
async fn change_a_lot(daemon: &Daemon, map: &str, first_id: u64) {
    let scan = |id: u64, from: f64, count| {
        json!({"robot": "r", "scan_id": first_id + id, "points": row(count), "guess": pose_json([from, 0.0, 0.0]),
               "align": false})
    };
    let made = async |path: &str, body: Value| {
        let answer = daemon.post(&format!("/v1/maps/{map}/{path}"), body).await;
        assert!(answer.status().is_success(), "{}", answer.text().await.unwrap());
    };
    let before = revision_of(daemon, map).await;
    made("scans", scan(0, 0.0, 30)).await;
    made("scans", scan(1, 2.0, 60)).await;
    made("deletions", json!({"points": row(12)})).await;
    made("scans", scan(2, -5.0, 40)).await;
    made("undo", json!({"robot": "r", "scan_id": first_id + 1})).await;
    made("undo", json!({"revision": before + 3})).await;
    assert_eq!(revision_of(daemon, map).await, before + 6);
}

#[tokio::test]
async fn a_watcher_has_what_the_map_has_at_every_revision() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let client = client_of(&daemon).await;
    let mut early = Watcher::default();
    let mut told = client.watch(&map("a"), WatchRequest::default()).await.unwrap();
    early.take(told.next().await.unwrap().unwrap());
    change_a_lot(&daemon, "a", 0).await;
    early.read_to(&mut told, 6).await;
    assert_eq!(early.resets, 1);
    assert!(matches!(&early.causes[0], Cause::Scan(scan) if scan.scan_id == Some(0)));
    assert_eq!(early.causes[2], Cause::Deletion);
    assert_eq!(early.causes[4], Cause::Undo { scans: vec![2], deletions: vec![] });
    assert_eq!(early.causes[5], Cause::Undo { scans: vec![], deletions: vec![3] });
    // Who joins late is told of the state, and who comes back of what came since.
    let mut late = Watcher::default();
    let mut told = client.watch(&map("a"), WatchRequest::default()).await.unwrap();
    late.read_to(&mut told, 6).await;
    assert_eq!((&late.voxels, late.resets, late.causes.len()), (&early.voxels, 1, 0));
    change_a_lot(&daemon, "a", 10).await;
    let request = WatchRequest { since: early.since(), ..WatchRequest::default() };
    let mut told = client.watch(&map("a"), request).await.unwrap();
    early.read_to(&mut told, 12).await;
    assert_eq!(early.resets, 1);
}

#[tokio::test]
async fn a_watcher_goes_on_after_a_restart_as_far_as_the_journal_reaches() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut watcher = Watcher::default();
    let mut told = client_of(&daemon).await.watch(&map("a"), WatchRequest::default()).await.unwrap();
    watcher.take(told.next().await.unwrap().unwrap());
    change_a_lot(&daemon, "a", 0).await;
    watcher.read_to(&mut told, 6).await;
    let data = daemon.stop().await;
    // What was told before the end is not told again; what came after is.
    assert!(!matches!(told.next().await, Some(Ok(_))), "nothing changed since");
    let daemon = Daemon::start_in(data, |_| {}).await;
    change_a_lot(&daemon, "a", 10).await;
    let request = WatchRequest { since: watcher.since(), ..WatchRequest::default() };
    let mut told = client_of(&daemon).await.watch(&map("a"), request).await.unwrap();
    watcher.read_to(&mut told, 12).await;
    assert_eq!((watcher.resets, watcher.causes.len()), (1, 12));
    // Of another map, of a revision that is not there, and of one that is not kept, the state is told first.
    let elsewhere = |revision, map_uuid| WatchRequest {
        since: Some(WatchedSince { revision, map_uuid, content_hash: None, state_hash: None }),
        ..WatchRequest::default()
    };
    for (revision, map_uuid) in [(12, Uuid::nil()), (13, watcher.map_uuid), (u64::MAX, watcher.map_uuid)] {
        let mut other = Watcher::default();
        let client = client_of(&daemon).await;
        let mut told = client.watch(&map("a"), elsewhere(revision, map_uuid)).await.unwrap();
        other.read_to(&mut told, 12).await;
        assert_eq!((other.resets, other.voxels), (1, watcher.voxels.clone()));
    }
}

/// An older data folder is put back, and other scans go on past the revision that copies have: the map has the uuid and
/// the revisions that they know, and other voxels.
#[tokio::test]
async fn a_copy_of_what_was_lost_when_an_older_data_folder_was_put_back_gets_the_whole_state() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(9)).await;
    let data = daemon.stop().await;
    let cold = tempfile::tempdir().unwrap();
    copy_folder(data.path(), cold.path());

    let daemon = Daemon::start_in(data, |_| {}).await;
    let address = daemon.grpc;
    change_a_lot(&daemon, "a", 0).await;
    let client = client_of(&daemon).await;
    let region = Region::cuboid([0.0, -1.0, -1.0], [2.0, 1.0, 1.0]).unwrap();
    let parts = [None, Some(region)];
    let mut before = Vec::new();
    for region in parts {
        let mut watcher = Watcher { is_part: region.is_some(), ..Watcher::default() };
        let request = WatchRequest { region, ..WatchRequest::default() };
        watcher.read_to(&mut client.watch(&map("a"), request).await.unwrap(), 7).await;
        before.push(watcher);
    }
    let mut replicas = Vec::new();
    for region in parts {
        let options = ReplicaOptions { region, ..ReplicaOptions::default() };
        replicas.push(Replica::open(client.clone(), map("a"), options).await.unwrap());
    }
    drop(daemon.stop().await);

    let daemon = Daemon::start_in(cold, |config| config.grpc.listen = address).await;
    for count in 20..29 {
        daemon.put_in("a", &row(count)).await;
    }
    let client = client_of(&daemon).await;
    for mut watcher in before {
        let region = watcher.is_part.then_some(region);
        // Who sends no hash, as clients did before there was one, is believed its revision: what is lost stays in its
        // copy.
        let since =
            watcher.since().map(|since| WatchedSince { content_hash: None, state_hash: None, ..since });
        let request = WatchRequest { since, region, ..WatchRequest::default() };
        let mut told = client.watch(&map("a"), request).await.unwrap();
        let first = told.next().await.unwrap().unwrap().event;
        assert!(matches!(&first, WatchEvent::Change(part) if part.revision == 8), "{first:?}");
        let request = WatchRequest { since: watcher.since(), region, ..WatchRequest::default() };
        watcher.read_to(&mut client.watch(&map("a"), request).await.unwrap(), 10).await;
        assert_eq!(watcher.resets, 2, "the whole state comes again");
        let expected = if watcher.is_part { 20 } else { 28 };
        assert_eq!(watcher.voxels.len(), expected);
        // Who has this history goes on in it.
        let request = WatchRequest { since: watcher.since(), region, ..WatchRequest::default() };
        let mut told = client.watch(&map("a"), request).await.unwrap();
        daemon.put_in("a", &row(28)).await;
        let next = watcher.revision + 1;
        watcher.read_to(&mut told, next).await;
        assert_eq!(watcher.resets, 2);
        let since = format!("since_revision={}&map_uuid={}", watcher.revision, watcher.map_uuid);
        let tried = [("0123456789abcdef", false), ("xyz", true), ("+123456789abcdef", true)];
        let fields = ["since_content_hash", "since_state_hash"];
        for (field, (hash, is_refused)) in fields.into_iter().flat_map(|field| tried.map(|of| (field, of))) {
            let path = format!("/v1/maps/a/watch?{since}&{field}={hash}");
            let mut answer = daemon.get(&path).await;
            assert_eq!(answer.status() == 400, is_refused, "{hash}");
            if !is_refused {
                let first = answer.chunk().await.unwrap().unwrap();
                let first = pb::WatchResponse::decode(&first[4..]).unwrap();
                assert!(matches!(first.event, Some(pb::watch_response::Event::State(_))), "{first:?}");
            }
        }
    }
    let (head, _) = daemon.contents("a").await;
    for (replica, expected) in replicas.iter().zip([28, 20]) {
        replica.wait_for_revision(head, PATIENCE).await.unwrap();
        let (status, voxels) = (replica.status(), replica.map().view().voxels().len());
        assert_eq!((status.resets, voxels), (2, expected), "{status:?}");
    }
}

#[tokio::test]
async fn who_is_behind_the_ring_and_the_journal_is_told_of_the_whole_state() {
    // In memory there is no journal, and this ring has room for nothing.
    let daemon = Daemon::start_with(|config| {
        config.data_dir = "".into();
        config.store.watch_bytes_max = 0;
    })
    .await;
    daemon.make_map("a").await;
    let client = client_of(&daemon).await;
    let mut watcher = Watcher::default();
    let mut told = client.watch(&map("a"), WatchRequest::default()).await.unwrap();
    watcher.take(told.next().await.unwrap().unwrap());
    for count in [3, 5, 8, 13] {
        daemon.put_in("a", &row(count)).await;
        let revision = revision_of(&daemon, "a").await;
        watcher.read_to(&mut told, revision).await;
        assert_eq!(watcher.voxels.len(), count);
    }
    assert_eq!((watcher.resets, watcher.causes.len()), (5, 0));
}

#[tokio::test]
async fn only_durable_revisions_are_told() {
    let daemon = Daemon::start_with(|config| {
        config.store.durability = Durability::Interval(Duration::from_secs(3600));
    })
    .await;
    daemon.make_map("a").await;
    let client = client_of(&daemon).await;
    let mut told = client.watch(&map("a"), WatchRequest::default()).await.unwrap();
    let mut watcher = Watcher::default();
    watcher.take(told.next().await.unwrap().unwrap());
    daemon.put_in("a", &row(3)).await;
    assert_eq!(revision_of(&daemon, "a").await, 1);
    // Nor the state that holds it.
    let mut joining = client.watch(&map("a"), WatchRequest::default()).await.unwrap();
    let quiet = Duration::from_millis(300);
    assert!(tokio::time::timeout(quiet, told.next()).await.is_err());
    assert!(tokio::time::timeout(quiet, joining.next()).await.is_err());
    // The end of the server makes it durable.
    let stopping = daemon.tell_to_stop();
    while let Some(Ok(message)) = told.next().await {
        watcher.take(message);
    }
    assert!(watcher.revision <= 1);
    stopping.stopped().await;
}

#[tokio::test]
async fn deltas_tell_of_the_voxels_of_a_level_that_appear_and_go() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let client = client_of(&daemon).await;
    daemon.put_in("a", &row(7)).await;
    for level in [0, 2, 3] {
        let request = WatchRequest { form: WatchForm::Deltas { level }, ..WatchRequest::default() };
        let mut told = client.watch(&map("a"), request).await.unwrap();
        let (mut voxels, mut revision) = (PlainSet::new(), 0);
        let begin = revision_of(&daemon, "a").await;
        change_a_lot(&daemon, "a", 100 * u64::from(level + 1)).await;
        while revision < begin + 6 {
            match told.next().await.unwrap().unwrap().event {
                WatchEvent::Heartbeat => {}
                WatchEvent::State(part) => {
                    assert_eq!((part.level, part.is_first, part.is_last), (level, true, true));
                    (voxels, revision) = (set_of(&part.voxels), part.version.revision);
                }
                WatchEvent::Change(part) => {
                    let (removed, added) = (set_of(&part.removed), set_of(&part.added));
                    assert!(removed.is_subset(&voxels) && added.is_disjoint(&voxels), "what really changed");
                    voxels = voxels.difference(&removed).copied().collect();
                    voxels.extend(added);
                    revision = part.revision;
                }
            }
        }
        let (_, finest) = daemon.contents("a").await;
        let expected: PlainSet = finest.iter().map(|i| up(i.map(|i| i as i32), level)).collect();
        assert_eq!(voxels, expected, "level {level}");
    }
    let request = WatchRequest { form: WatchForm::Deltas { level: 12 }, ..WatchRequest::default() };
    let error = client.watch(&map("a"), request).await.unwrap_err();
    assert!(error.to_string().contains("level must lie in"), "{error}");
}

#[tokio::test]
async fn a_watch_over_http_is_the_same_messages_behind_their_lengths() {
    let daemon = Daemon::start_with(|config| config.limits.watch_heartbeat_s = 0.05).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(9)).await;
    let mut body = daemon.get("/v1/maps/a/watch").await;
    let (mut bytes, mut watcher, mut heartbeats) = (Vec::new(), Watcher::default(), 0);
    let mut next = async || loop {
        if let Some((length, rest)) = bytes.split_first_chunk::<4>() {
            let length = u32::from_le_bytes(*length) as usize;
            if rest.len() >= length {
                let message = pb::WatchResponse::decode(&rest[..length]).unwrap();
                bytes.drain(..4 + length);
                return Some(message);
            }
        }
        bytes.extend_from_slice(&body.chunk().await.unwrap()?);
    };
    watcher.take(next().await.unwrap().try_into().unwrap());
    assert_eq!((watcher.revision, watcher.voxels.len()), (1, 9));
    daemon.put_in("a", &row(20)).await;
    while watcher.revision < 2 || heartbeats < 2 {
        let message: WatchMessage = next().await.unwrap().try_into().unwrap();
        heartbeats += usize::from(message.event == WatchEvent::Heartbeat);
        watcher.take(message);
    }
    assert_eq!(watcher.voxels.len(), 20);
    daemon.delete("/v1/maps/a").await;
    let last = loop {
        if let Some(pb::watch_response::Event::Failure(failure)) = next().await.unwrap().event {
            break failure;
        }
    };
    assert_eq!(last.reason, "map_not_found");
    assert_eq!(next().await, None);
    for (query, reason) in [
        ("since_revision=3", "missing_field"),
        ("map_uuid=x", "missing_field"),
        ("since_revision=3&map_uuid=x", "bad_uuid"),
        ("min=0,0,0", "half_a_box"),
        ("level=1", "bad_query"),
        ("viewpoints=perhaps", "bad_query"),
    ] {
        let refused = json_of(daemon.get(&format!("/v1/maps/a/watch?{query}")).await).await;
        assert_eq!(refused["reason"], reason, "{query}: {refused}");
    }
}

#[tokio::test]
async fn one_address_without_a_key_leaves_watches_to_others() {
    let daemon = Daemon::start_with(|config| {
        (config.limits.watches_max, config.limits.caller_watches_max) = (3, 2);
    })
    .await;
    daemon.make_map("a").await;
    let client = client_of(&daemon).await;
    let mut watches = Vec::new();
    for _ in 0..2 {
        watches.push(client.watch(&map("a"), WatchRequest::default()).await.unwrap());
    }
    let refused = client.watch(&map("a"), WatchRequest::default()).await.unwrap_err().to_string();
    assert!(refused.contains("caller_watches_max is 2") && refused.contains("127.0.0.1"), "{refused}");
    let refused = json_of(daemon.get("/v1/maps/a/watch").await).await;
    assert_eq!(refused["reason"], "overloaded", "{refused}");
}

#[tokio::test]
async fn watches_have_a_limit_of_their_own() {
    let daemon = Daemon::start_with(|config| config.limits.watches_max = 3).await;
    daemon.make_map("a").await;
    let client = client_of(&daemon).await;
    let mut watches = Vec::new();
    for _ in 0..3 {
        watches.push(client.watch(&map("a"), WatchRequest::default()).await.unwrap());
    }
    let refused = client.watch(&map("a"), WatchRequest::default()).await.unwrap_err();
    assert!(refused.to_string().contains("watches_max is 3"), "{refused}");
    let begin = std::time::Instant::now();
    while daemon.metric("mrol_watches_open").await != Some(3.0) {
        assert!(begin.elapsed() < PATIENCE, "open watches are not counted");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    drop(watches);
    let begin = std::time::Instant::now();
    while client.watch(&map("a"), WatchRequest::default()).await.is_err() {
        assert!(begin.elapsed() < PATIENCE, "dropped watches are still counted");
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn who_takes_no_message_is_told_so_in_the_end() {
    let daemon = Daemon::start_with(|config| config.limits.watch_unread_max_s = 0.2).await;
    daemon.make_map("a").await;
    // More than lies on the way to a client that does not read: a block of its own for each point.
    for layer in 0..6u8 {
        let points: Vec<[f32; 3]> =
            (0..60_000).map(|i| [(i % 300) as f32, (i / 300) as f32, f32::from(layer)]).collect();
        let path = format!("/v1/maps/a/scans?robot=r{layer}&align=false&guess=0,0,0,0,0,0,1");
        let put = daemon.post_bytes(&path, bytes_of(&points)).await;
        assert!(put.status().is_success(), "{}", put.text().await.unwrap());
    }
    let client = client_of(&daemon).await;
    let mut stalled = client.watch(&map("a"), WatchRequest::default()).await.unwrap();
    // It takes none until the watch is over.
    let begin = std::time::Instant::now();
    while daemon.metric("mrol_jobs_running{pool=\"watch\"}").await != Some(0.0)
        || begin.elapsed() < Duration::from_secs(2)
    {
        assert!(begin.elapsed() < PATIENCE, "the state is not made");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let last = loop {
        match stalled.next().await.expect("an error at the end") {
            Ok(message) => assert_ne!(message.event, WatchEvent::Heartbeat, "it was told of everything"),
            Err(error) => break error.to_string(),
        }
    };
    assert!(last.contains("watch_unread_max_s is 0.2"), "{last}");
}

#[tokio::test]
async fn a_replica_answers_as_the_server_does_at_the_same_revision() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(4)).await;
    let client = client_of(&daemon).await;
    let filter = Some(FilterSettings::default());
    let options = ReplicaOptions { filter, ..ReplicaOptions::default() };
    let replica = Replica::open(client.clone(), map("a"), options).await.unwrap();
    let region = Region::cuboid([0.0, -1.0, -1.0], [1.0, 1.0, 1.0]).unwrap();
    let options = ReplicaOptions { region: Some(region), ..ReplicaOptions::default() };
    let part = Replica::open(client.clone(), map("a"), options).await.unwrap();
    for round in 1..4 {
        change_a_lot(&daemon, "a", 100 * round).await;
        let revision = revision_of(&daemon, "a").await;
        for replica in [&replica, &part] {
            replica.wait_for_revision(revision, PATIENCE).await.unwrap();
        }
        for level in 0..3 {
            for lookup in [Lookup::Exact, Lookup::Bloom] {
                let query = PointQuery {
                    points: (-70..70)
                        .map(|i| [i as f32 * 0.1 + 0.05, 0.05, 0.05].into())
                        .collect::<Vec<_>>()
                        .into(),
                    map_from_points: None,
                    level,
                    lookup,
                    min_revision: Some(revision),
                    map_uuid: Some(replica.status().map_uuid),
                    keep_out: false,
                };
                let own = replica.query_points(&query).unwrap();
                assert_eq!(own, client.query_points(&map("a"), query.clone()).await.unwrap());
                assert!(part.query_points(&query).unwrap_err().to_string().contains("outside of the region"));
                let inside = PointQuery { points: vec![[0.55, 0.05, 0.05].into()].into(), ..query };
                let own = part.query_points(&inside).unwrap();
                let theirs = client.query_points(&map("a"), inside).await.unwrap();
                assert_eq!((own.occupied, own.version.content_hash), (theirs.occupied, None));
            }
        }
        let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();
        assert!(*replica.map().viewpoints() == *Snapshot::decode(&file).unwrap().contents.viewpoints);
        let status = replica.status();
        assert_eq!((status.version.revision, status.resets, status.is_connected), (revision, 1, true));
    }
    assert_eq!(replica.map().settings().filter, filter);
    let of_part = *part.map().settings();
    assert_eq!((of_part.filter, of_part.moments), (None, false));
    let inside: BTreeSet<_> = part.map().view().voxels().iter().collect();
    let expected: BTreeSet<_> = replica.map().view().voxels_in(&region, 0).into_iter().collect();
    assert_eq!(inside, expected);
}

#[tokio::test]
async fn a_replica_of_a_region_refuses_coarse_voxels_that_reach_out_of_it() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &[[0.65, 0.05, 0.05]]).await;
    let region = Some(Region::cuboid([0.0; 3], [0.5; 3]).unwrap());
    let options = ReplicaOptions { region, ..ReplicaOptions::default() };
    let part = Replica::open(client_of(&daemon).await, map("a"), options).await.unwrap();
    // Its voxel of level 1 lies in the region, that of level 2 goes from 0.4 to 0.8 m, and is occupied.
    let query = |level| PointQuery {
        points: vec![[0.45, 0.05, 0.05].into()].into(),
        map_from_points: None,
        level,
        lookup: Lookup::Exact,
        min_revision: None,
        map_uuid: None,
        keep_out: false,
    };
    assert_eq!(part.query_points(&query(0)).unwrap().points_occupied, 0);
    let refused = part.query_points(&query(2)).unwrap_err().to_string();
    assert!(refused.contains("points[0] is outside of the region"), "{refused}");
}

#[tokio::test]
async fn a_replica_notices_a_map_that_was_deleted_and_made_again() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(4)).await;
    let options = ReplicaOptions::default();
    let replica = Replica::open(client_of(&daemon).await, map("a"), options).await.unwrap();
    let first = replica.status();
    daemon.delete("/v1/maps/a").await;
    let mut statuses = replica.statuses();
    let lost = statuses.wait_for(|status| !status.is_connected);
    drop(tokio::time::timeout(PATIENCE, lost).await.unwrap().unwrap());
    // It goes on to answer what it knows.
    assert_eq!(replica.map().voxels(0), 4);
    daemon.make_map("a").await;
    daemon.put_in("a", &row(9)).await;
    let again = statuses.wait_for(|status| status.map_uuid != first.map_uuid && status.version.revision == 1);
    drop(tokio::time::timeout(PATIENCE, again).await.unwrap().unwrap());
    assert_eq!((replica.map().voxels(0), replica.status().resets), (9, 2));
    drop(daemon.stop().await);
}
