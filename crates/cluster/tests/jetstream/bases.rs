//! Map files are put, pointed to and fetched, and the log is cut behind them.

use std::time::{Duration, Instant};

use mrol_cluster::{BaseError, BasePointers, BaseStore, JetStreamLog, Orphans};
use mrol_map::map::StateHash;
use mrol_service::replication::{Base, LogError, Position, ReplicatedLog};
use uuid::Uuid;

use crate::support::{NatsServers, Writer, eventually, read_all};

fn base_at(position: Position) -> Base {
    let revision = position.sequence;
    let state = Some(StateHash::from_bits(revision));
    Base { position, epoch: 1, revision, state, ..Base::default() }
}

/// Bytes that no compression makes fewer.
fn file_of(bytes: usize) -> Vec<u8> {
    let mut state = 1_u64;
    let next = |_| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 33) as u8
    };
    (0..bytes).map(next).collect()
}

#[test]
fn a_node_that_comes_late_loads_the_base_and_reads_on() {
    let Some(servers) = NatsServers::start(3) else { return };
    let (engine, map) = (servers.engine(), Uuid::new_v4());
    let log = eventually(|| JetStreamLog::create(&engine, map));
    let store = eventually(|| BaseStore::create(&engine));
    let pointers = eventually(|| BasePointers::create(&engine));
    let mut writer = Writer::new(&log);
    for _ in 0..8 {
        let message = crate::support::changes(writer.position, 1_000);
        writer.publish_at_last(&message);
    }
    assert!(matches!(pointers.read(map), Ok(None)));
    let file = file_of(20_000_000);
    let base = base_at(writer.written[4].position());
    let begun = Instant::now();
    eventually(|| store.put(map, &base, &file));
    println!("20 MB put in {:?}", begun.elapsed());
    let revision = pointers.change(map, &base, 0).unwrap();
    assert!(matches!(pointers.change(map, &base, 0), Err(BaseError::Changed)));
    log.cut_before(base.position.sequence).unwrap();

    let (found, found_revision) = eventually(|| match pointers.read(map) {
        Ok(Some(found)) => Ok(found),
        other => Err(format!("{other:?}")),
    });
    assert_eq!((&found, found_revision), (&base, revision));
    let begun = Instant::now();
    let fetched = store.fetch(map, &found).unwrap();
    println!("20 MB fetched in {:?}", begun.elapsed());
    assert!(fetched == file, "another file");
    assert_eq!(log.read_behind(found.position).unwrap(), writer.written[5..]);
    assert_eq!(log.read_behind(writer.written[0].position()), Err(LogError::NoSuchPosition));
    assert_eq!(read_all(&log).0, writer.written[4..]);

    store.delete(map, &base).unwrap();
    pointers.forget(map, revision).unwrap();
    assert!(!store.has(map, &base).unwrap());
}

#[test]
fn a_file_whose_upload_was_cut_short_is_not_there_and_is_put_again() {
    let Some(mut servers) = NatsServers::start(1) else { return };
    let (engine, map) = (servers.engine(), Uuid::new_v4());
    let store = BaseStore::create(&engine).unwrap();
    let file = file_of(50_000_000);
    let base = base_at(Position { sequence: 3, id: Some(Uuid::new_v4()) });
    let cut = std::thread::scope(|scope| {
        let put = scope.spawn(|| store.put(map, &base, &file));
        std::thread::sleep(Duration::from_millis(100));
        servers.kill_all();
        put.join().unwrap()
    });
    assert!(matches!(cut, Err(BaseError::Unavailable(_))), "{cut:?}");
    servers.start_all();
    assert!(!eventually(|| store.has(map, &base)));
    let pointers = BasePointers::create(&engine).unwrap();
    let sweep = |before: &Orphans| store.sweep(&pointers, before).unwrap();
    let orphans = sweep(&Orphans::default());
    assert!(!orphans.is_empty(), "nothing was put before the servers were killed");
    assert!(matches!(store.fetch(map, &base), Err(BaseError::Unavailable(_))));
    eventually(|| store.put(map, &base, &file));
    pointers.change(map, &base, 0).unwrap();
    assert_eq!(sweep(&Orphans::default()), orphans, "what was put is no orphan");
    assert_eq!(sweep(&orphans), Orphans::default());
    assert!(store.fetch(map, &base).unwrap() == file, "another file");

    // One that nothing points to goes, and then its pieces; unless it was put again meanwhile.
    let unused = base_at(Position { sequence: 4, id: Some(Uuid::new_v4()) });
    store.put(map, &unused, &file).unwrap();
    let found = sweep(&Orphans::default());
    store.put(map, &unused, &file).unwrap();
    let again = sweep(&found);
    assert_ne!(again, found);
    assert!(store.has(map, &unused).unwrap(), "it is another by now");
    let pieces = sweep(&again);
    assert!(!store.has(map, &unused).unwrap());
    assert!(!pieces.is_empty());
    assert_eq!(sweep(&pieces), Orphans::default());
    // So do the descriptions of those that were deleted, however many.
    for number in 0..1_100 {
        let one = base_at(Position { sequence: 100 + number, id: None });
        store.put(map, &one, b"a file").unwrap();
        store.delete(map, &one).unwrap();
    }
    store.put(map, &unused, &file).unwrap();
    store.delete(map, &unused).unwrap();
    let deleted = sweep(&Orphans::default());
    assert!(!deleted.is_empty());
    assert_eq!(sweep(&deleted), Orphans::default());
    assert!(store.fetch(map, &base).unwrap() == file, "another file");
}
