//! A site: three servers of NATS and three nodes, each a process of its own.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use mrol::client::{Client, ClientError, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{ContentHash, MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::{MapInfo, ScanRequest};
use tempfile::TempDir;
use tokio::runtime::Runtime;
use uuid::Uuid;

use crate::link::Link;
use crate::nats::{NatsServers, free_ports};

pub(crate) const NODES: usize = 3;

/// How long anything may take that is to come by itself: the machine may be busy with other tests.
pub(crate) const WITHIN: Duration = Duration::from_secs(60);

/// Why a change is refused that was not made, while NATS is late.
const LATE: [&str; 2] = ["no_quorum", "not_leader"];

/// A site: three servers of NATS and three nodes.
pub(crate) struct Site {
    pub(crate) nats: NatsServers,
    folder: TempDir,
    nodes: Vec<Node>,
    runtime: Runtime,
    /// Settings of all nodes besides.
    settings: &'static [(&'static str, &'static str)],
}

struct Node {
    http: u16,
    grpc: u16,
    /// How it reaches the servers of NATS.
    to_nats: Vec<Link>,
    /// How the other nodes reach it.
    from_others: Link,
    process: Option<Child>,
}

impl Site {
    /// A site with nodes that are ready; none where there is no program `nats-server`.
    pub(crate) fn start() -> Option<Self> {
        Self::start_with(&[])
    }

    /// The same, with settings as variables.
    pub(crate) fn start_with(settings: &'static [(&'static str, &'static str)]) -> Option<Self> {
        let nats = NatsServers::start_apart(NODES)?;
        let node = |ports: &[u16]| {
            let (http, grpc, linked) = (ports[0], ports[1], ports[2]);
            let to_nats = nats.ports().into_iter().map(Link::to).collect();
            Node { http, grpc, to_nats, from_others: Link::between(linked, grpc), process: None }
        };
        let nodes = free_ports(3 * NODES).chunks(3).map(node).collect();
        drop(nats.engine());
        let (folder, runtime) = (TempDir::new().unwrap(), Runtime::new().unwrap());
        let mut site = Self { nats, folder, nodes, runtime, settings };
        (0..NODES).for_each(|node| site.start_node(node));
        (0..NODES).for_each(|node| site.wait_until_ready(node));
        Some(site)
    }

    /// The data folder of a node.
    pub(crate) fn data(&self, node: usize) -> PathBuf {
        self.folder.path().join(format!("data{node}"))
    }

    /// Starts a node that does not run.
    pub(crate) fn start_node(&mut self, index: usize) {
        let (data, log) = (self.data(index), self.folder.path().join(format!("{index}.log")));
        fs::create_dir_all(&data).unwrap();
        let node = &mut self.nodes[index];
        if node.process.is_some() {
            return;
        }
        let urls: Vec<_> =
            node.to_nats.iter().map(|link| format!("nats://127.0.0.1:{}", link.port())).collect();
        let mut command = serve(&data, [node.http, node.grpc], &log);
        command
            .args(["--cluster", &urls.join(","), "--node", &format!("n{index}")])
            // A small disk is to be filled.
            .env("MROL_LIMITS__DISK_FREE_LOW_MIB", "4")
            .env("MROL_LIMITS__DISK_FREE_RESUME_MIB", "8")
            .env("MROL_CLUSTER__GRPC", format!("http://127.0.0.1:{}", node.from_others.port()))
            .envs(self.settings.iter().copied());
        node.from_others.open();
        node.process = Some(command.spawn().unwrap());
    }

    /// Starts a server by itself, whose data folder is beside those of the nodes.
    pub(crate) fn start_beside(&self) -> Alone {
        let ports = free_ports(2);
        let (http, grpc) = (ports[0], ports[1]);
        let (data, log) = (self.folder.path().join("alone"), self.folder.path().join("alone.log"));
        let process = serve(&data, [http, grpc], &log).spawn().unwrap();
        Alone { process, grpc: format!("http://127.0.0.1:{grpc}") }
    }

    /// Starts a server by itself on the folder and the ports of a node that does not run.
    pub(crate) fn start_alone(&mut self, index: usize, options: &[&str]) {
        let (data, log) = (self.data(index), self.folder.path().join(format!("{index}.log")));
        let node = &mut self.nodes[index];
        assert!(node.process.is_none());
        node.process = Some(serve(&data, [node.http, node.grpc], &log).args(options).spawn().unwrap());
    }

    /// Waits until a process ends by itself: whether it did what it was asked.
    pub(crate) fn has_succeeded(&mut self, index: usize) -> bool {
        self.nodes[index].process.take().unwrap().wait().unwrap().success()
    }

    /// Kills a node with -9.
    pub(crate) fn kill_node(&mut self, index: usize) {
        if let Some(mut process) = self.nodes[index].process.take() {
            self.nodes[index].from_others.close();
            process.kill().unwrap();
            process.wait().unwrap();
        }
    }

    /// Sends a node a signal, by its name.
    pub(crate) fn signal(&self, index: usize, name: &str) {
        let id = self.process(index).to_string();
        assert!(Command::new("kill").args(["-s", name, &id]).status().unwrap().success());
    }

    /// Tells a node to end, as a service manager does, and waits for it.
    pub(crate) fn end_node(&mut self, index: usize) {
        self.signal(index, "TERM");
        let mut process = self.nodes[index].process.take().unwrap();
        let begun = Instant::now();
        while process.try_wait().unwrap().is_none() {
            assert!(begun.elapsed() < WITHIN, "node {index} does not end: {}", self.log_of(index));
            std::thread::sleep(Duration::from_millis(20));
        }
        self.nodes[index].from_others.close();
    }

    /// Cuts a node off from NATS, and the other nodes from it.
    pub(crate) fn cut_off(&self, index: usize) {
        self.nodes[index].links().for_each(Link::cut);
    }

    /// Lets it be reached again.
    pub(crate) fn mend(&self, index: usize) {
        self.nodes[index].links().for_each(Link::mend);
    }

    /// Address of gRPC of a node, as its clients reach it.
    pub(crate) fn grpc(&self, index: usize) -> String {
        format!("http://127.0.0.1:{}", self.nodes[index].grpc)
    }

    /// Address of HTTP of a node.
    pub(crate) fn http(&self, index: usize) -> String {
        format!("http://127.0.0.1:{}", self.nodes[index].http)
    }

    /// All of them, that of this node first.
    pub(crate) fn all_grpc(&self, first: usize) -> String {
        let all: Vec<_> = (0..NODES).map(|node| self.grpc((first + node) % NODES)).collect();
        all.join(",")
    }

    /// The process of a node that runs.
    pub(crate) fn process(&self, index: usize) -> u32 {
        self.nodes[index].process.as_ref().unwrap().id()
    }

    /// What a node has said in its log.
    pub(crate) fn all_log_of(&self, index: usize) -> String {
        fs::read_to_string(self.folder.path().join(format!("{index}.log"))).unwrap_or_default()
    }

    /// What the log of a node ends with.
    pub(crate) fn log_of(&self, index: usize) -> String {
        let text = self.all_log_of(index);
        let lines: Vec<_> = text.lines().collect();
        lines[lines.len().saturating_sub(40)..].join("\n")
    }

    /// Prints what the logs of all nodes end with.
    pub(crate) fn print_logs(&self) {
        (0..NODES).for_each(|node| println!("--- node {node}\n{}", self.log_of(node)));
    }

    /// Waits until a node says that it is ready.
    #[track_caller]
    pub(crate) fn wait_until_ready(&self, index: usize) {
        let url = format!("http://127.0.0.1:{}/readyz", self.nodes[index].http);
        let begun = Instant::now();
        loop {
            let asked = self.runtime.block_on(async { reqwest::get(&url).await });
            if asked.is_ok_and(|answer| answer.status() == 200) {
                return;
            }
            assert!(begun.elapsed() < WITHIN, "node {index} is not ready: {}", self.log_of(index));
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// A client of a node, on the runtime of the site.
    pub(crate) fn client(&self, addresses: &str) -> Client {
        let begun = Instant::now();
        loop {
            match self.runtime.block_on(Client::connect(addresses)) {
                Ok(client) => return client,
                Err(error) => assert!(begun.elapsed() < WITHIN, "{error}"),
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// The runtime of all clients.
    pub(crate) fn runtime(&self) -> &Runtime {
        &self.runtime
    }

    /// Makes the map of the test.
    pub(crate) fn create(&self, map: &MapName) {
        let client = self.client(&self.all_grpc(0));
        let settings = NewMap { levels: Some(2), ..NewMap::of(0.5) };
        self.answered(&LATE, async || client.create_map(map, settings).await);
    }

    /// Deletes a map by way of a node.
    pub(crate) fn delete(&self, index: usize, map: &MapName) {
        let client = self.client(&self.grpc(index));
        self.answered(&LATE, async || client.delete_map(map).await);
    }

    /// Asks until it is answered, again while it is refused for one of these reasons.
    fn answered<T>(&self, passing: &[&str], ask: impl AsyncFn() -> Result<T, ClientError>) -> T {
        let begun = Instant::now();
        loop {
            match self.runtime.block_on(ask()) {
                Ok(answer) => return answer,
                Err(error) => {
                    let is_passing = error.reason().is_some_and(|reason| passing.contains(&reason));
                    assert!(is_passing && begun.elapsed() < WITHIN, "{error}");
                }
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Puts one voxel more into a map, under a number, again until that is acknowledged; the revision that it makes.
    pub(crate) fn insert(&self, addresses: &str, map: &MapName, number: u64, place: Point) -> u64 {
        let client = self.client(addresses);
        let scan = ScanRequest {
            scan_id: Some(number),
            guess: Guess::Pose(Pose::identity()),
            at_guess: true,
            ..ScanRequest::new(RobotName::new("late").unwrap(), vec![place].into())
        };
        let passing = [&LATE[..], &["outcome_unknown"]].concat();
        let answer = self.answered(&passing, async || client.insert_scan(map, scan.clone()).await);
        answer.version.revision
    }

    /// Revision, content, scans and voxels of a map at a node.
    pub(crate) fn state(&self, index: usize, map: &MapName) -> Option<MapState> {
        let client = self.runtime.block_on(Client::connect(&self.grpc(index))).ok()?;
        let info = self.runtime.block_on(client.map_info(map)).ok()?;
        Some(MapState::of(&info))
    }

    /// The node that leads a map, by its log's own words: the last that said so.
    pub(crate) fn leader(&self, map: &MapName) -> usize {
        let begun = Instant::now();
        loop {
            let said = (0..NODES).filter_map(|node| {
                let text = self.all_log_of(node);
                let leads = |line: &&str| line.contains(" leads map=") && line.contains(map.as_str());
                let epoch = |line: &str| line.split("epoch=").nth(1)?.split(' ').next()?.parse::<u64>().ok();
                Some((text.lines().filter(leads).filter_map(epoch).max()?, node))
            });
            if let Some((_, node)) = said.max() {
                return node;
            }
            assert!(begun.elapsed() < WITHIN, "nobody leads");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Node {
    fn links(&self) -> impl Iterator<Item = &Link> {
        self.to_nats.iter().chain([&self.from_others])
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.print_logs();
        }
        (0..NODES).for_each(|node| self.kill_node(node));
    }
}

/// A server by itself, until it is dropped.
pub(crate) struct Alone {
    process: Child,
    pub(crate) grpc: String,
}

impl Alone {
    pub(crate) fn id(&self) -> u32 {
        self.process.id()
    }
}

impl Drop for Alone {
    fn drop(&mut self) {
        _ = self.process.kill();
        _ = self.process.wait();
    }
}

/// How a node has a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MapState {
    pub(crate) uuid: Uuid,
    pub(crate) revision: u64,
    pub(crate) hash: Option<ContentHash>,
    pub(crate) scans: usize,
    pub(crate) voxels: usize,
}

impl MapState {
    pub(crate) fn of(info: &MapInfo) -> Self {
        Self {
            uuid: info.version.map_uuid,
            revision: info.version.revision,
            hash: info.version.content_hash,
            scans: info.scans,
            voxels: info.levels[0].voxels,
        }
    }
}

/// A disk of a test: a small file system in memory, which can be filled. Mounting takes root.
pub(crate) struct SmallDisk(PathBuf);

impl SmallDisk {
    /// In the place of what a folder has; none without the right to mount.
    pub(crate) fn over(folder: &Path, megabytes: u32) -> Option<Self> {
        fs::create_dir_all(folder).unwrap();
        let size = format!("size={megabytes}m");
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(folder).stderr(Stdio::null());
        mount.status().is_ok_and(|status| status.success()).then(|| Self(folder.to_owned()))
    }

    /// Takes all of it.
    pub(crate) fn fill(&self) {
        let filled = fs::write(self.0.join("filler"), vec![1; 512 << 20]);
        assert!(filled.is_err(), "it is larger than it should be");
    }

    /// Takes all but so many megabytes.
    pub(crate) fn fill_but(&self, megabytes: usize) {
        let df =
            Command::new("df").args(["--block-size=1M", "--output=avail"]).arg(&self.0).output().unwrap();
        let said = String::from_utf8(df.stdout).unwrap();
        let free: usize = said.lines().last().unwrap().trim().parse().unwrap();
        fs::write(self.0.join("filler"), vec![1; (free - megabytes) << 20]).unwrap();
    }

    /// Gives back what was taken.
    pub(crate) fn free(&self) {
        fs::remove_file(self.0.join("filler")).unwrap();
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}

/// The program of the nodes: that which is built with the tests, or another.
pub(crate) fn program() -> PathBuf {
    std::env::var_os("MROL_CLUSTER_PROGRAM")
        .map_or_else(|| PathBuf::from(env!("CARGO_BIN_EXE_mrol")), PathBuf::from)
}

/// A daemon, which says to `log` what it does.
fn serve(data: &Path, [http, grpc]: [u16; 2], log: &Path) -> Command {
    let log = fs::OpenOptions::new().create(true).append(true).open(log).unwrap();
    let mut command = Command::new(program());
    command
        .args(["serve", "--log-level", "info,mrol::audit=off", "--data-dir", data.to_str().unwrap()])
        .args(["--http-listen", &format!("127.0.0.1:{http}"), "--grpc-listen", &format!("127.0.0.1:{grpc}")])
        .env("MROL_STORE__SNAPSHOT_INTERVAL_S", "5")
        .stdout(Stdio::null())
        .stderr(log);
    command
}
