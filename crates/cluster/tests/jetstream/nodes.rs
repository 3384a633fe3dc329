//! Nodes share their maps by themselves: they enter and delete them, take over from one that is gone, and hand over.

use std::net::TcpListener;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mrol_cluster::{BaseLimits, Forwarder, ForwarderSettings, Node, NodeSettings};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{ContentHash, MapName, MapSettings, RobotName};
use mrol_map::mapping::Guess;
use mrol_service::replication::NodeName;
use mrol_service::{Lead, MapService, Reason, ScanRequest, ServiceError, ServiceSettings};
use mrol_store::OpeningProgress;
use tempfile::TempDir;
use tokio::runtime::Runtime;

use crate::support::NatsServers;

/// How long anything may take here: of several machines' worth of servers on one that may be busy.
pub(crate) const WITHIN: Duration = Duration::from_secs(40);

/// A server with its node; its port is one at which nothing listens once it is gone.
pub(crate) struct Server {
    pub(crate) service: MapService,
    pub(crate) node: Arc<Node>,
    pub(crate) runtime: Runtime,
    _port: TcpListener,
}

pub(crate) fn name(text: &str) -> MapName {
    MapName::new(text).unwrap()
}

fn forwarder(node: &str) -> Forwarder {
    // Nobody answers at the ports of these nodes.
    let call_timeout = Duration::from_secs(2);
    let settings = ForwarderSettings::new(NodeName::new(node).unwrap());
    Forwarder::new(ForwarderSettings { call_timeout, ..settings }).unwrap()
}

impl Server {
    pub(crate) fn start(servers: &NatsServers, node: &str, folder: &Path) -> Self {
        Self::start_with(servers, node, folder, |_| {})
    }

    /// A node at which maps are made that so many nodes hold; all, where that is 0.
    pub(crate) fn start_with_copies(servers: &NatsServers, node: &str, folder: &Path, copies: usize) -> Self {
        Self::start_with(servers, node, folder, |settings| settings.copies = copies)
    }

    /// One of which a test says more.
    pub(crate) fn start_with(
        servers: &NatsServers,
        node: &str,
        folder: &Path,
        say: impl FnOnce(&mut NodeSettings),
    ) -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("http://{}", port.local_addr().unwrap());
        let mut settings = NodeSettings {
            name: NodeName::new(node).unwrap(),
            http: address.clone(),
            grpc: address,
            version: "0".to_owned(),
            record_version: 1,
            copies: 0,
            engine: servers.settings(),
            bases: BaseLimits::default(),
        };
        say(&mut settings);
        let node = Node::new(settings, forwarder(node));
        let settings = ServiceSettings {
            data_dir: Some(folder.to_owned()),
            cluster: Some(node.cluster()),
            ..ServiceSettings::default()
        };
        let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
        let runtime = Runtime::new().unwrap();
        let begun = (Arc::clone(&node), service.clone());
        runtime.block_on(async move { begun.0.begin(begun.1) });
        Self { service, node, runtime, _port: port }
    }

    /// Ends without a word to the others.
    pub(crate) fn vanish(self) {
        self.runtime.block_on(self.node.end());
    }

    pub(crate) fn create(&self, map: &str) -> bool {
        let settings = MapSettings::new(0.5, 2);
        retried(|| self.runtime.block_on(self.service.create_map(name(map), settings))).1
    }

    pub(crate) fn version(&self, map: &str) -> Option<(u64, Option<ContentHash>)> {
        let version = self.runtime.block_on(self.service.version_of(&name(map))).ok()?;
        Some((version.revision, version.content_hash))
    }

    pub(crate) fn leads(&self, map: &str) -> bool {
        let lead = self.runtime.block_on(self.service.lead_of(&name(map)));
        lead.is_ok_and(|lead| matches!(&*lead.borrow(), Lead::Shared { is_here: true, .. }))
    }

    /// A scan of a voxel of its own, under its number.
    pub(crate) fn scan(number: u64) -> ScanRequest {
        let points = vec![Point::new(0.25 + number as f32 * 0.5, 0.25, 0.25)].into();
        ScanRequest {
            scan_id: Some(number),
            guess: Guess::Pose(Pose::identity()),
            at_guess: true,
            ..ScanRequest::new(RobotName::new("robot").unwrap(), points)
        }
    }

    /// Inserts a scan of a voxel of its own, under its number.
    pub(crate) fn insert(&self, map: &str, number: u64) -> Result<u64, ServiceError> {
        let answer = self.runtime.block_on(self.service.insert_scan(&name(map), Self::scan(number)))?;
        Ok(answer.version.revision)
    }
}

/// Asks again until it is answered.
#[track_caller]
pub(crate) fn retried<T>(ask: impl Fn() -> Result<T, ServiceError>) -> T {
    let begun = Instant::now();
    loop {
        match ask() {
            Ok(answer) => return answer,
            Err(error) => {
                let may_come_again = [Reason::NoQuorum, Reason::NotLeader, Reason::OutcomeUnknown];
                assert!(may_come_again.contains(&error.reason), "{error}");
                assert!(begun.elapsed() < WITHIN, "{error}");
                std::thread::sleep(Duration::from_millis(20));
            }
        }
    }
}

#[track_caller]
pub(crate) fn waited(what: &str, mut is_so: impl FnMut() -> bool) -> Duration {
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed() < WITHIN, "{what}");
        std::thread::sleep(Duration::from_millis(10));
    }
    begun.elapsed()
}

/// The server that leads a map.
#[track_caller]
pub(crate) fn leader<'a>(servers: &[&'a Server], map: &str) -> &'a Server {
    waited("a leader", || servers.iter().any(|server| server.leads(map)));
    servers.iter().find(|server| server.leads(map)).unwrap()
}

#[test]
fn a_node_that_is_gone_loses_the_lead_and_one_that_leaves_hands_it_over() {
    let Some(nats) = NatsServers::start(3) else { return };
    drop(nats.engine());
    let folders: Vec<_> = (0..3).map(|_| TempDir::new().unwrap()).collect();
    let start = |index: usize| Server::start(&nats, ["a", "b", "c"][index], folders[index].path());
    let (a, b, c) = (start(0), start(1), start(2));
    assert!(a.create("hall"));
    assert!(!b.create("hall"), "another node made it");
    let all = [&a, &b, &c];
    for number in 0..20 {
        assert_eq!(retried(|| leader(&all, "hall").insert("hall", number)), number + 1);
    }
    let equal = |servers: &[&Server], revision: u64| {
        waited("equal copies", || {
            let versions: Vec<_> = servers.iter().map(|server| server.version("hall")).collect();
            versions[0].is_some_and(|(at, _)| at == revision) && versions.iter().all(|it| *it == versions[0])
        })
    };
    equal(&all, 20);

    // The one that leads is gone.
    let first = leader(&all, "hall");
    let index = all.iter().position(|server| std::ptr::eq(*server, first)).unwrap();
    let mut running: Vec<Server> = vec![a, b, c];
    running.remove(index).vanish();
    let rest: Vec<&Server> = running.iter().collect();
    println!(
        "taken over after {:?}",
        waited("a take-over", || rest.iter().any(|server| server.leads("hall")))
    );
    let second = leader(&rest, "hall");
    assert_eq!(retried(|| second.insert("hall", 20)), 21);
    equal(&rest, 21);

    // It is back, and follows.
    let back = start(index);
    waited("the map is back", || back.version("hall").is_some_and(|(revision, _)| revision == 21));
    assert!(!back.leads("hall"));

    // The one that leads now hands over and goes.
    let leaving = running.iter().position(|server| server.leads("hall")).unwrap();
    let begun = Instant::now();
    running[leaving].runtime.block_on(running[leaving].node.leave(&running[leaving].service));
    let others = running.iter().enumerate().filter(|(index, _)| *index != leaving).map(|(_, server)| server);
    let others: Vec<&Server> = others.chain([&back]).collect();
    waited("a hand-over", || others.iter().any(|server| server.leads("hall")));
    println!("handed over after {:?}", begun.elapsed());
    running.remove(leaving).vanish();
    let rest: Vec<&Server> = running.iter().chain([&back]).collect();
    let third = leader(&rest, "hall");
    assert_eq!(retried(|| third.insert("hall", 21)), 22);
    equal(&rest, 22);
}

#[test]
fn maps_are_made_and_deleted_on_all_nodes() {
    let Some(nats) = NatsServers::start(3) else { return };
    drop(nats.engine());
    let folders: Vec<_> = (0..2).map(|_| TempDir::new().unwrap()).collect();
    let (a, b) = (Server::start(&nats, "a", folders[0].path()), Server::start(&nats, "b", folders[1].path()));
    for round in 0..10 {
        assert!(a.create("hall"), "round {round}");
        for number in 0..3 {
            // The lead may have moved meanwhile.
            assert_eq!(retried(|| leader(&[&a, &b], "hall").insert("hall", number)), number + 1);
        }
        waited("a copy", || b.version("hall").is_some_and(|(revision, _)| revision == 3));
        b.runtime.block_on(b.service.delete_map(&name("hall"))).unwrap();
        assert_eq!(b.version("hall"), None);
        waited("it is deleted there too", || a.version("hall").is_none());
    }
    // A map that was deleted while a node was away is deleted there when it is back.
    assert!(a.create("yard"));
    waited("a copy", || b.version("yard").is_some());
    b.vanish();
    a.runtime.block_on(a.service.delete_map(&name("yard"))).unwrap();
    assert!(a.create("yard"), "another of that name");
    let led = leader(&[&a], "yard");
    retried(|| led.insert("yard", 1));
    let b = Server::start(&nats, "b", folders[1].path());
    waited("the new map there", || b.version("yard") == a.version("yard"));
    // A map from a file, with what it has.
    let file = a.runtime.block_on(a.service.snapshot_map(&name("yard"))).unwrap();
    let restored =
        a.runtime.block_on(a.service.restore_map(name("copy"), file.bytes.clone(), false)).unwrap();
    assert_eq!(restored.version.revision, 1);
    waited("its copy", || b.version("copy") == a.version("copy") && a.version("copy").is_some());
    let refused = a.runtime.block_on(a.service.restore_map(name("copy"), file.bytes, true)).unwrap_err();
    assert_eq!(refused.reason, Reason::MapShared);
    assert_eq!(retried(|| leader(&[&a, &b], "copy").insert("copy", 2)), 2);
    waited("it follows", || b.version("copy") == a.version("copy") && b.version("copy").unwrap().0 == 2);
}

/// What a server made by itself under the name of a map of the cluster is kept, is not taken for that map, and does not
/// delete it.
#[test]
fn another_map_of_the_same_name_is_kept_under_another_name() {
    let Some(nats) = NatsServers::start(1) else { return };
    drop(nats.engine());
    let folders: Vec<_> = (0..2).map(|_| TempDir::new().unwrap()).collect();
    let runtime = Runtime::new().unwrap();
    let data_dir = Some(folders[1].path().to_owned());
    let alone = ServiceSettings { data_dir, ..ServiceSettings::default() };
    let alone = MapService::open(alone, &OpeningProgress::default()).unwrap();
    runtime.block_on(alone.create_map(name("hall"), MapSettings::new(0.5, 2))).unwrap();
    drop(alone);
    let a = Server::start(&nats, "a", folders[0].path());
    assert!(a.create("hall"));
    let led = leader(&[&a], "hall");
    retried(|| led.insert("hall", 0));
    let b = Server::start(&nats, "b", folders[1].path());
    waited("the cluster's map there", || b.version("hall") == a.version("hall"));
    assert_eq!(b.version("hall-replaced-0").map(|(revision, _)| revision), Some(0));
    // What is none of the cluster's is deleted here alone, and what is, everywhere.
    b.runtime.block_on(b.service.delete_map(&name("hall-replaced-0"))).unwrap();
    assert!(a.version("hall").is_some() && b.version("hall-replaced-0").is_none());
    b.runtime.block_on(b.service.delete_map(&name("hall"))).unwrap();
    waited("it is deleted there too", || a.version("hall").is_none());
}

/// A second process that has a node's name by mistake follows, and neither claims nor is heard; it is heard once the
/// first is gone.
#[test]
fn a_second_process_under_the_name_of_a_node_disturbs_nobody() {
    let Some(nats) = NatsServers::start(1) else { return };
    drop(nats.engine());
    let folders: Vec<_> = (0..3).map(|_| TempDir::new().unwrap()).collect();
    let (a, b) = (Server::start(&nats, "a", folders[0].path()), Server::start(&nats, "b", folders[1].path()));
    assert!(a.create("hall"));
    retried(|| leader(&[&a, &b], "hall").insert("hall", 0));
    waited("both have it", || a.version("hall").is_some() && a.version("hall") == b.version("hall"));
    let epoch = || match &*b.runtime.block_on(b.service.lead_of(&name("hall"))).unwrap().borrow() {
        Lead::Shared { epoch, .. } => *epoch,
        other => panic!("{other:?}"),
    };
    let (led_by_a, before) = (a.leads("hall"), epoch());
    let second = Server::start(&nats, "a", folders[2].path());
    for number in 1..20 {
        retried(|| leader(&[&a, &b], "hall").insert("hall", number));
        std::thread::sleep(Duration::from_millis(400));
    }
    assert_eq!((epoch(), a.leads("hall")), (before, led_by_a), "the lead has moved");
    assert!(!second.node.status().is_joined && second.node.is_behind(WITHIN));
    waited("it follows", || second.version("hall") == a.version("hall"));
    a.vanish();
    waited("it is heard", || second.node.status().is_joined);
    assert_eq!(retried(|| leader(&[&second, &b], "hall").insert("hall", 20)), 21);
    waited("equal copies", || second.version("hall") == b.version("hall"));
}

#[test]
fn a_server_by_itself_or_another_node_does_not_open_the_folder_of_a_node() {
    let folder = TempDir::new().unwrap();
    let open = |node: Option<&str>| {
        let cluster = node.map(|node| {
            let name = NodeName::new(node).unwrap();
            let settings = NodeSettings {
                name,
                http: String::new(),
                grpc: String::new(),
                version: String::new(),
                record_version: 1,
                bases: BaseLimits::default(),
                copies: 0,
                engine: mrol_cluster::EngineSettings {
                    urls: Vec::new(),
                    credentials: mrol_cluster::Credentials::None,
                    root_certificates: None,
                    replicas: 1,
                    name: String::new(),
                },
            };
            Node::new(settings, forwarder(node)).cluster()
        });
        let data_dir = Some(folder.path().to_owned());
        let settings = ServiceSettings { data_dir, cluster, ..ServiceSettings::default() };
        MapService::open(settings, &OpeningProgress::default()).map(drop).map_err(|error| error.message)
    };
    assert_eq!(open(Some("a")), Ok(()));
    assert!(open(None).unwrap_err().contains("node a of a cluster"));
    assert!(open(Some("b")).unwrap_err().contains("cluster.node = \"a\""));
    assert_eq!(open(Some("a")), Ok(()));
}
