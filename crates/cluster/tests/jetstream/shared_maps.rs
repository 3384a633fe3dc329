//! Three nodes share a map by a log at NATS: servers and nodes are killed, older copies of all stores put back. Every
//! acknowledged change is there once, and all nodes are equal.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use mrol_cluster::{Engine, Following, JetStreamLog};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{ContentHash, MapName, MapSettings, RobotName};
use mrol_map::mapping::Guess;
use mrol_service::replication::NodeName;
use mrol_service::{Lead, MapService, Reason, ScanRequest, ServiceError, ServiceSettings};
use mrol_store::OpeningProgress;
use tempfile::TempDir;
use tokio::runtime::Runtime;
use uuid::Uuid;

use crate::support::{NatsServers, eventually};

/// How long all nodes may take until they are equal.
const EQUAL_WITHIN: Duration = Duration::from_secs(40);

struct Node {
    name: NodeName,
    service: MapService,
    _following: Following,
}

fn map() -> MapName {
    MapName::new("hall").unwrap()
}

fn service(folder: &Path) -> MapService {
    let settings = ServiceSettings { data_dir: Some(folder.to_owned()), ..ServiceSettings::default() };
    MapService::open(settings, &OpeningProgress::default()).unwrap()
}

impl Node {
    /// A node on what its folder has: of a map that it has no copy of, `file` is one.
    fn start(runtime: &Runtime, engine: &Engine, name: &str, folder: &Path, copy: &(Uuid, Bytes)) -> Self {
        let (service, (uuid, file)) = (service(folder), copy.clone());
        if runtime.block_on(service.map_info(&map())).is_err() {
            runtime.block_on(service.copy_map(map(), uuid, file, false)).unwrap();
        }
        let log = Arc::new(eventually(|| JetStreamLog::create(engine, uuid)));
        let node = NodeName::new(name).unwrap();
        eventually(|| match runtime.block_on(service.share_map(&map(), log.clone(), node.clone())) {
            // Where the log does not answer yet, the node follows it once it does.
            Err(error) if error.reason != Reason::NoQuorum => Err(error),
            _ => Ok(()),
        });
        let following = Following::begin(service.clone(), map(), &log);
        Self { name: node, service, _following: following }
    }

    fn version(&self, runtime: &Runtime) -> (u64, Option<ContentHash>) {
        let version = runtime.block_on(self.service.map_info(&map())).unwrap().version;
        (version.revision, version.content_hash)
    }

    /// Inserts a scan of a voxel of its own, again and again under its number until it is acknowledged.
    async fn insert(&self, number: u64) -> u64 {
        loop {
            let points = vec![Point::new(0.25 + number as f32 * 0.5, 0.25, 0.25)].into();
            let scan = ScanRequest {
                scan_id: Some(number),
                guess: Guess::Pose(Pose::identity()),
                at_guess: true,
                ..ScanRequest::new(RobotName::new("robot").unwrap(), points)
            };
            match self.service.insert_scan(&map(), scan).await {
                Ok(answer) => return answer.version.revision,
                Err(error) => check_to_retry(&error),
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
}

/// Lets a node lead, as soon as it may.
fn lead(runtime: &Runtime, nodes: &[&Node], leader: usize) {
    eventually(|| {
        let others = nodes.iter().enumerate().filter(|(index, _)| *index != leader);
        let live = others.map(|(_, node)| (node.name.clone(), node.version(runtime).0)).collect();
        runtime.block_on(async {
            nodes[leader].service.claim_map(&map(), None).await?;
            let claim = match &*nodes[leader].service.lead_of(&map()).await?.borrow() {
                Lead::Shared { claim, .. } => *claim,
                _ => None,
            };
            nodes[leader].service.open_map(&map(), claim, live).await
        })
    });
}

#[track_caller]
fn check_to_retry(error: &ServiceError) {
    let may_come_again = [Reason::NoQuorum, Reason::NotLeader, Reason::OutcomeUnknown, Reason::Overloaded];
    assert!(may_come_again.contains(&error.reason), "{error}");
}

/// All nodes are at one revision with one hash, and every scan is there once.
#[track_caller]
fn check_equal(runtime: &Runtime, nodes: &[&Node], scans: u64) {
    let begun = Instant::now();
    loop {
        let versions: Vec<_> = nodes.iter().map(|node| node.version(runtime)).collect();
        if versions.iter().all(|version| *version == versions[0]) && versions[0].0 == scans {
            break;
        }
        assert!(begun.elapsed() < EQUAL_WITHIN, "{versions:?} after {scans} scans");
        std::thread::sleep(Duration::from_millis(50));
    }
    for node in nodes {
        let info = runtime.block_on(node.service.map_info(&map())).unwrap();
        assert_eq!((info.scans as u64, info.levels[0].voxels as u64), (scans, scans));
    }
}

#[test]
fn nodes_that_share_a_map_lose_nothing_where_servers_and_nodes_are_killed_and_older_stores_put_back() {
    let Some(mut servers) = NatsServers::start(3) else { return };
    let runtime = Runtime::new().unwrap();
    let folders: Vec<_> = (0..4).map(|_| TempDir::new().unwrap()).collect();
    let first = service(folders[0].path());
    runtime.block_on(first.create_map(map(), MapSettings::new(0.5, 2))).unwrap();
    let file = runtime.block_on(first.snapshot_map(&map())).unwrap();
    let copy = (file.version.map_uuid, file.bytes);
    drop(first);

    let engines: Vec<_> = (0..4).map(|_| servers.engine()).collect();
    let start =
        |name: &str, index: usize| Node::start(&runtime, &engines[index], name, folders[index].path(), &copy);
    let (a, b, c) = (start("a", 0), start("b", 1), start("c", 2));
    let refused =
        runtime.block_on(b.service.create_map(MapName::new("other").unwrap(), MapSettings::new(0.5, 2)));
    assert!(refused.is_ok(), "maps that nobody shares are as before");

    lead(&runtime, &[&a, &b, &c], 0);
    let mut scans = 0;
    let mut insert = |node: &Node, count: u64| {
        for _ in 0..count {
            assert_eq!(
                runtime.block_on(node.insert(scans)),
                scans + 1,
                "in the order in which they are asked for"
            );
            scans += 1;
        }
        scans
    };
    insert(&a, 50);
    // A follower takes no change, and changes nothing.
    let scan = ScanRequest {
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("stray").unwrap(), vec![Point::new(0.25, 5.25, 0.25)].into())
    };
    let refused = runtime.block_on(b.service.insert_scan(&map(), scan)).unwrap_err();
    assert_eq!(refused.reason, Reason::NotLeader);
    check_equal(&runtime, &[&a, &b, &c], 50);

    // A server of NATS is killed, with its changes under way.
    servers.kill(1);
    insert(&a, 20);
    servers.start_one(1);
    check_equal(&runtime, &[&a, &b, &c], 70);

    // The node that leads is gone without a word; it comes back on its folder, and follows.
    drop(a);
    lead(&runtime, &[&b, &c], 0);
    insert(&b, 20);
    let a = start("a", 0);
    check_equal(&runtime, &[&a, &b, &c], 90);

    // The stores of all servers are put back to an older copy: the node that leads gives back what they lost.
    servers.kill_all();
    let older = servers.copy_stores();
    servers.start_all();
    eventually(|| runtime.block_on(b.service.follow_map(&map(), None)));
    insert(&b, 30);
    check_equal(&runtime, &[&a, &b, &c], 120);
    servers.kill_all();
    servers.put_back_stores(&older);
    servers.start_all();
    lead(&runtime, &[&a, &b, &c], 2);
    insert(&c, 10);
    check_equal(&runtime, &[&a, &b, &c], 130);

    // A node that has nothing reads all of it from the log.
    let d = start("d", 3);
    check_equal(&runtime, &[&a, &b, &c, &d], 130);
}

/// How long after a change was acknowledged a follower has it: a figure, not a promise.
#[test]
fn a_follower_has_a_change_soon_after_it_is_acknowledged() {
    let Some(servers) = NatsServers::start(3) else { return };
    let runtime = Runtime::new().unwrap();
    let folders: Vec<_> = (0..2).map(|_| TempDir::new().unwrap()).collect();
    let first = service(folders[0].path());
    runtime.block_on(first.create_map(map(), MapSettings::new(0.5, 2))).unwrap();
    let file = runtime.block_on(first.snapshot_map(&map())).unwrap();
    let copy = (file.version.map_uuid, file.bytes);
    drop(first);
    let engines = [servers.engine(), servers.engine()];
    let start =
        |name, index: usize| Node::start(&runtime, &engines[index], name, folders[index].path(), &copy);
    let (a, b) = (start("a", 0), start("b", 1));
    lead(&runtime, &[&a, &b], 0);
    let (mut taken, mut lags) = (Vec::new(), Vec::new());
    for number in 0..200 {
        let begun = Instant::now();
        let revision = runtime.block_on(a.insert(number));
        let acknowledged = Instant::now();
        taken.push(acknowledged - begun);
        while b.version(&runtime).0 < revision {
            assert!(acknowledged.elapsed() < EQUAL_WITHIN);
            std::thread::sleep(Duration::from_micros(200));
        }
        lags.push(acknowledged.elapsed());
    }
    for (what, figures) in [("acknowledged after", &mut taken), ("followed after", &mut lags)] {
        figures.sort();
        println!("{what} p50 {:?}, p99 {:?}", figures[100], figures[198]);
    }
}
