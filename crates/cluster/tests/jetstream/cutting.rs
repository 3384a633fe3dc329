//! Nodes put bases of a map and cut its log while it changes; a node that was away for longer than the log reaches
//! begins with the base.

use std::time::Duration;

use mrol_cluster::{BaseLimits, ClusterStore, JetStreamLog};
use mrol_service::MapVersion;
use mrol_service::replication::Base;
use tempfile::TempDir;

use crate::link::Link;
use crate::nodes::{Server, leader, name, retried, waited};
use crate::support::{NatsServers, eventually};

/// A base is due after so few messages.
const SMALL: BaseLimits = BaseLimits {
    bytes_max: u64::MAX,
    messages_max: 20,
    looked_every: Duration::from_millis(1),
    swept_every: Duration::from_secs(2),
};

/// What NATS has of a map.
struct Kept {
    store: ClusterStore,
    log: JetStreamLog,
    version: MapVersion,
}

impl Kept {
    fn of(nats: &NatsServers, server: &Server, map: &str) -> Self {
        let store = eventually(|| ClusterStore::find(&nats.settings()));
        let version = server.runtime.block_on(server.service.version_of(&name(map))).unwrap();
        let log = eventually(|| JetStreamLog::open(&store.engine, version.map_uuid));
        Self { store, log, version }
    }

    fn base(&self) -> Base {
        eventually(|| self.store.pointers.read(self.version.map_uuid)).unwrap().0
    }

    /// How many messages were cut off.
    fn cut(&self) -> u64 {
        let used = eventually(|| self.log.used());
        used.last_sequence - used.messages
    }

    /// Has a map changed until its log begins behind a revision, which made no more messages than that; numbers of
    /// scans go on from `number`.
    fn write_until_cut_behind(&self, revision: u64, servers: &[&Server], map: &str, number: &mut u64) {
        waited("the log is cut", || {
            for _ in 0..10 {
                assert_eq!(retried(|| leader(servers, map).insert(map, *number)), *number + 1);
                *number += 1;
            }
            let base = self.base();
            base.revision > revision && self.cut() > revision + base.epoch
        });
    }
}

#[test]
fn a_node_that_was_away_for_longer_than_the_log_reaches_begins_with_the_base() {
    let Some(nats) = NatsServers::start_apart(3) else { return };
    drop(nats.engine());
    let folders: Vec<_> = (0..4).map(|_| TempDir::new().unwrap()).collect();
    let links: Vec<_> = nats.ports().into_iter().map(Link::to).collect();
    let start = |index: usize| {
        Server::start_with(&nats, ["a", "b", "c", "d"][index], folders[index].path(), |settings| {
            settings.bases = SMALL;
            if index == 2 {
                let urls = links.iter().map(|link| format!("nats://127.0.0.1:{}", link.port()));
                settings.engine.urls = urls.collect();
            }
        })
    };
    let (a, b) = (start(0), start(1));
    assert!(a.create("hall"));
    leader(&[&a, &b], "hall");
    let c = start(2);
    waited("its copy", || c.version("hall").is_some());
    let kept = Kept::of(&nats, &a, "hall");
    let equal = |servers: &[&Server], scans: u64| {
        waited("equal copies", || {
            let versions: Vec<_> = servers.iter().map(|server| server.version("hall")).collect();
            versions[0].is_some_and(|(at, _)| at == scans) && versions.iter().all(|it| *it == versions[0])
        });
        for server in servers {
            let info = server.runtime.block_on(server.service.map_info(&name("hall"))).unwrap();
            assert_eq!((info.scans as u64, info.levels[0].voxels as u64), (scans, scans));
        }
    };
    let mut scans = 0;
    let former = |server: &Server, revision: u64| server.version(&format!("hall-replaced-{revision}"));

    // One that goes on running is cut off from NATS, and counts as gone after a while.
    links.iter().for_each(Link::cut);
    let behind = c.version("hall").unwrap().0;
    kept.write_until_cut_behind(behind, &[&a, &b], "hall", &mut scans);
    assert_eq!(c.version("hall").map(|(revision, _)| revision), Some(behind));
    links.iter().for_each(Link::mend);
    equal(&[&a, &b, &c], scans);
    assert_eq!(former(&c, behind).map(|(revision, _)| revision), Some(behind), "what it had is kept");

    // One that does not run.
    let behind = c.version("hall").unwrap().0;
    c.vanish();
    kept.write_until_cut_behind(behind, &[&a, &b], "hall", &mut scans);
    let c = start(2);
    equal(&[&a, &b, &c], scans);
    assert!(former(&c, behind).is_some());

    // One that has nothing; and it can go on from there.
    let d = start(3);
    equal(&[&a, &b, &c, &d], scans);
    for server in [a, b] {
        server.vanish();
    }
    assert_eq!(retried(|| leader(&[&c, &d], "hall").insert("hall", scans)), scans + 1);
    equal(&[&c, &d], scans + 1);
}

/// The node that puts a base is gone at each moment of it: what it left keeps nobody from going on.
#[test]
fn a_base_that_was_put_in_part_keeps_no_node_from_going_on() {
    let Some(nats) = NatsServers::start(3) else { return };
    drop(nats.engine());
    let folders: Vec<_> = (0..3).map(|_| TempDir::new().unwrap()).collect();
    let start = |node: &str, folder: usize, bases: BaseLimits| {
        Server::start_with(&nats, node, folders[folder].path(), |settings| settings.bases = bases)
    };
    let a = start("a", 0, BaseLimits::default());
    assert!(a.create("hall"));
    for number in 0..30 {
        assert_eq!(retried(|| leader(&[&a], "hall").insert("hall", number)), number + 1);
    }
    let kept = Kept::of(&nats, &a, "hall");
    let (first, map) = (kept.base(), kept.version.map_uuid);
    let (base, file) = a.runtime.block_on(a.service.log_base(&name("hall"))).unwrap().unwrap();
    assert_eq!((first.revision, base.revision), (0, 30));
    // The file is there and nothing points to it: a node begins with the base before.
    kept.store.bases.put(map, &base, &file).unwrap();
    let b = start("b", 1, BaseLimits::default());
    waited("a copy", || b.version("hall") == a.version("hall"));
    // It is pointed to, and nothing was cut.
    let (_, revision) = kept.store.pointers.read(map).unwrap().unwrap();
    kept.store.pointers.change(map, &base, revision).unwrap();
    let c = start("c", 2, BaseLimits::default());
    waited("a copy", || c.version("hall") == a.version("hall"));
    for server in [a, b, c] {
        server.vanish();
    }
    // Whoever leads then puts the next, and cuts.
    let a = start("a", 0, SMALL);
    let mut scans = 30;
    kept.write_until_cut_behind(0, &[&a], "hall", &mut scans);
    assert!(kept.base().revision > 30);
    let b = start("b", 1, SMALL);
    waited("equal copies", || b.version("hall") == a.version("hall"));
    // A file that nothing points to does not stay.
    let lost = Base { revision: 7, ..Base::default() };
    kept.store.bases.put(map, &lost, &file).unwrap();
    waited("it is swept", || !eventually(|| kept.store.bases.has(map, &lost)));
    assert!(kept.store.bases.has(map, &kept.base()).unwrap(), "the base stays");
}
