//! Beats of nodes in their bucket, and values changed by compare-and-set.

use std::collections::BTreeMap;

use mrol_cluster::{Beat, Beats, Bucket, BucketError, Liveness, MapHead};
use mrol_service::replication::NodeName;
use uuid::Uuid;

use crate::support::{NatsServers, eventually};

fn beat(revision: u64) -> Beat {
    Beat {
        http: "http://127.0.0.1:7333".to_owned(),
        grpc: "http://127.0.0.1:7334".to_owned(),
        version: "0.2.0".to_owned(),
        record_version: 1,
        maps: BTreeMap::from([(
            Uuid::from_u128(1),
            MapHead {
                revision,
                epoch: 2,
                claim: None,
                sequence: revision,
                leads: false,
                is_parted: false,
                agrees: true,
            },
        )]),
        unjoined: BTreeMap::new(),
        free_bytes: 1 << 30,
        no_room: None,
        has_ended: false,
    }
}

#[test]
fn the_last_beats_of_all_nodes_are_read_and_say_who_is_gone() {
    let Some(mut servers) = NatsServers::start(3) else { return };
    let engine = servers.engine();
    let beats = eventually(|| Beats::create(&engine));
    assert_eq!(beats.read(), Ok(Vec::new()));
    let (ours, theirs) = (NodeName::new("a").unwrap(), NodeName::new("b").unwrap());
    eventually(|| beats.put(&theirs, &beat(1)));
    let last = eventually(|| beats.put(&theirs, &beat(2)));
    let mut liveness = Liveness::new(ours.clone());
    for own in 0..6 {
        let revision = eventually(|| beats.put(&ours, &beat(own)));
        liveness.own_beat_acknowledged(revision);
        // The replica that answers may lag for a moment.
        eventually(|| {
            let revisions = beats.read().map_err(|error| error.to_string())?;
            let revisions = revisions.into_iter().map(|beat| (beat.node, beat.revision)).collect();
            liveness.beats_read(&revisions).then_some(()).ok_or_else(|| "an older reading".to_owned())
        });
        assert_eq!(liveness.is_gone(&theirs), own >= 4, "{own}");
        if own == 2 {
            servers.kill(0);
        }
    }
    let read = beats.read().unwrap();
    let of_them = read.iter().find(|beat| beat.node == theirs).unwrap();
    assert_eq!((of_them.revision, &of_them.beat), (last, &beat(2)));
    beats.remove(of_them).unwrap();
    assert_eq!(beats.remove(of_them), Err(BucketError::Changed));
    eventually(|| match beats.read().unwrap().len() {
        1 => Ok(()),
        count => Err(format!("{count} beats")),
    });
}

#[test]
fn a_key_is_changed_by_compare_and_set() {
    let Some(servers) = NatsServers::start(1) else { return };
    let engine = servers.engine();
    let bucket = Bucket::create(&engine, "mrol-test").unwrap();
    let again = Bucket::create(&engine, "mrol-test").unwrap();
    assert_eq!(bucket.read("key"), Ok(None));
    let first = bucket.put("key", "1".into(), Some(0)).unwrap();
    assert_eq!(bucket.put("key", "2".into(), Some(0)), Err(BucketError::Changed));
    bucket.put("other", "x".into(), None).unwrap();
    let second = again.put("key", "2".into(), Some(first)).unwrap();
    assert_eq!(bucket.put("key", "3".into(), Some(first)), Err(BucketError::Changed));
    let entry = bucket.read("key").unwrap().unwrap();
    assert_eq!((entry.key.as_str(), entry.revision, &entry.value[..]), ("key", second, &b"2"[..]));
    assert_eq!(bucket.delete("key", first), Err(BucketError::Changed));
    bucket.delete("key", second).unwrap();
    assert_eq!(bucket.read("key"), Ok(None));
    assert_eq!(bucket.read_all().unwrap().len(), 1);
}

#[test]
fn without_servers_a_beat_is_not_acknowledged() {
    let Some(mut servers) = NatsServers::start(1) else { return };
    let engine = servers.engine();
    let beats = Beats::create(&engine).unwrap();
    servers.kill_all();
    let node = NodeName::new("a").unwrap();
    assert!(matches!(beats.put(&node, &beat(1)), Err(BucketError::Unavailable { .. })));
    assert!(matches!(beats.read(), Err(BucketError::Unavailable { .. })));
    servers.start_all();
    eventually(|| beats.put(&node, &beat(1)));
    assert_eq!(beats.read().unwrap().len(), 1);
}
