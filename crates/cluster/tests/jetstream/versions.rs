//! Nodes of two versions side by side, of which the newer one writes records that the older one cannot read.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::Duration;

use mrol_map::geometry::{Point, Pose};
use mrol_map::map::RobotName;
use mrol_map::mapping::Guess;
use mrol_service::{Reason, ScanRequest};
use parking_lot::{Mutex, RwLock};
use tempfile::TempDir;

use crate::nodes::{Server, name, waited};
use crate::support::NatsServers;

/// Versions of the records that the nodes write and read.
const OLDER: u32 = 1;
const NEWER: u32 = 2;

const NODES: usize = 3;
const WRITERS: u64 = 2;
const NAMES: [&str; NODES] = ["a", "b", "c"];

/// Three nodes, of which each is exchanged while others write.
struct Site {
    nats: NatsServers,
    folders: Vec<TempDir>,
    servers: RwLock<[Option<Server>; NODES]>,
    /// The versions of those that have joined, and were not told to end.
    joined: Mutex<BTreeMap<usize, u32>>,
    is_over: AtomicBool,
    acknowledged: Mutex<u64>,
}

impl Site {
    fn start_one(&self, index: usize, version: u32) {
        let say = |settings: &mut mrol_cluster::NodeSettings| settings.record_version = version;
        let server = Server::start_with(&self.nats, NAMES[index], self.folders[index].path(), say);
        self.servers.write()[index] = Some(server);
        waited("it has joined", || self.with(index, |server| server.node.status().is_joined));
        self.joined.lock().insert(index, version);
    }

    fn with<T>(&self, index: usize, ask: impl FnOnce(&Server) -> T) -> T {
        ask(self.servers.read()[index].as_ref().unwrap())
    }

    fn leader(&self) -> Option<usize> {
        let servers = self.servers.read();
        servers.iter().position(|server| server.as_ref().is_some_and(|server| server.leads("hall")))
    }

    /// Ends a node as a service manager does, and starts it with another version.
    fn exchange(&self, index: usize, version: u32) {
        self.joined.lock().remove(&index);
        self.with(index, |server| server.runtime.block_on(server.node.leave(&server.service)));
        let server = self.servers.write()[index].take().unwrap();
        server.vanish();
        self.start_one(index, version);
        waited("it has followed", || {
            let states: Vec<_> = (0..NODES).map(|node| self.with(node, |it| it.version("hall"))).collect();
            let furthest = states.iter().flatten().map(|(revision, _)| *revision).max().unwrap();
            states[index].is_some_and(|(revision, _)| revision + 10 > furthest)
        });
        self.write_on();
    }

    /// Waits until more is acknowledged.
    fn write_on(&self) {
        let wanted = *self.acknowledged.lock() + 10;
        waited("it is acknowledged", || *self.acknowledged.lock() >= wanted);
    }

    /// Inserts scans of one voxel each, under their numbers, again and again until they are acknowledged.
    fn write(&self, writer: u64) {
        let robot = RobotName::new(&format!("writer-{writer}")).unwrap();
        let mut number = 0;
        while !self.is_over.load(Ordering::Acquire) {
            let point = Point::new(0.25 + number as f32 * 0.5, 0.25 + writer as f32 * 0.5, 0.25);
            let scan = ScanRequest {
                scan_id: Some(number),
                guess: Guess::Pose(Pose::identity()),
                at_guess: true,
                ..ScanRequest::new(robot.clone(), vec![point].into())
            };
            while !self.try_to_insert(&scan) {
                sleep(Duration::from_millis(10));
            }
            *self.acknowledged.lock() += 1;
            number += 1;
        }
    }

    /// False where nobody leads, a scan was refused, or what became of it is not known.
    fn try_to_insert(&self, scan: &ScanRequest) -> bool {
        let Some(index) = self.leader() else { return false };
        let servers = self.servers.read();
        let Some(server) = &servers[index] else { return false };
        let refused = server.runtime.block_on(server.service.insert_scan(&name("hall"), scan.clone())).err();
        if let Some(error) = &refused {
            let may_be_told = [
                Reason::NoQuorum,
                Reason::NotLeader,
                Reason::OutcomeUnknown,
                Reason::Draining,
                Reason::Starting,
            ];
            assert!(may_be_told.contains(&error.reason), "{error}");
        }
        refused.is_none()
    }
}

/// No change is lost, no caller hears anything but that it is to try again, and no node leads whose records another
/// cannot read.
#[test]
fn nodes_are_exchanged_for_those_of_a_newer_version_while_others_write() {
    let Some(nats) = NatsServers::start(1) else { return };
    drop(nats.engine());
    let site = Arc::new(Site {
        nats,
        folders: (0..NODES).map(|_| TempDir::new().unwrap()).collect(),
        servers: RwLock::new([const { None }; NODES]),
        joined: Mutex::default(),
        is_over: AtomicBool::new(false),
        acknowledged: Mutex::new(0),
    });
    (0..NODES).for_each(|index| site.start_one(index, OLDER));
    assert!(site.with(0, |server| server.create("hall")));
    waited("their copies", || (0..NODES).all(|node| site.with(node, |it| it.version("hall").is_some())));
    let write = |writer| {
        let site = Arc::clone(&site);
        spawn(move || site.write(writer))
    };
    let writers: Vec<JoinHandle<()>> = (0..WRITERS).map(write).collect();
    site.write_on();

    let leads_newer = |site: &Site| {
        let joined = site.joined.lock().clone();
        site.leader().and_then(|leader| joined.get(&leader).copied()) == Some(NEWER)
    };
    for index in 0..NODES {
        site.exchange(index, NEWER);
        let oldest = site.joined.lock().values().copied().min();
        assert!(oldest == Some(NEWER) || !leads_newer(&site), "an older node may not read what is written");
    }
    waited("a newer node leads", || leads_newer(&site));

    // An older one that comes back leads, since the others can read what it writes, until it is exchanged as well.
    let back = (site.leader().unwrap() + 1) % NODES;
    site.exchange(back, OLDER);
    waited("the older node leads", || site.leader() == Some(back));
    site.write_on();
    assert_eq!(site.leader(), Some(back));
    site.exchange(back, NEWER);
    waited("a newer node leads", || leads_newer(&site));

    site.is_over.store(true, Ordering::Release);
    writers.into_iter().for_each(|writer| writer.join().unwrap());
    let scans = *site.acknowledged.lock();
    waited("equal copies, with each scan once", || {
        let states: Vec<_> = (0..NODES).map(|node| site.with(node, |it| it.version("hall"))).collect();
        states[0].is_some_and(|(revision, _)| revision == scans) && states.iter().all(|it| *it == states[0])
    });
    for node in 0..NODES {
        let info = site.with(node, |it| it.runtime.block_on(it.service.map_info(&name("hall"))).unwrap());
        assert_eq!((info.scans as u64, info.levels[0].voxels as u64), (scans, scans));
    }
    println!("{scans} scans, each once");
}
