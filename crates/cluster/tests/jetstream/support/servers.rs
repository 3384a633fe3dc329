//! NATS servers of a test, which it kills and starts again.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use mrol_cluster::{Credentials, Engine, EngineSettings};
use tempfile::TempDir;

use super::skipped::skipped;

/// Path of the program `nats-server`.
const PROGRAM: &str = "NATS_SERVER_PROGRAM";

/// How long servers may take until they serve. Three elect a leader within some seconds; the machine may be busy.
const SERVING_WITHIN: Duration = Duration::from_secs(40);

/// NATS servers of a test, one or a cluster of three, each with its store in a folder that goes with them.
pub(crate) struct NatsServers {
    folder: TempDir,
    program: PathBuf,
    servers: Vec<Server>,
}

struct Server {
    port: u16,
    monitor: u16,
    process: Option<Child>,
}

impl NatsServers {
    /// So many servers, or `None` where there is no program: the test is skipped.
    pub(crate) fn start(count: usize) -> Option<Self> {
        Self::start_with(count, "", "")
    }

    /// So many servers that do not tell clients of each other: those reach only what they know.
    pub(crate) fn start_apart(count: usize) -> Option<Self> {
        Self::start_of(count, "", "", "no_advertise: true")
    }

    /// So many servers, with more of a configuration, and of that of their stores.
    pub(crate) fn start_with(count: usize, more: &str, of_stores: &str) -> Option<Self> {
        Self::start_of(count, more, of_stores, "")
    }

    fn start_of(count: usize, more: &str, of_stores: &str, of_cluster: &str) -> Option<Self> {
        let Some(program) = std::env::var_os(PROGRAM) else {
            skipped(&format!("no nats-server (set {PROGRAM} to what .ci/nats-server prints)"));
            return None;
        };
        let folder = TempDir::new().unwrap();
        let ports = free_ports(3 * count);
        let (clients, rest) = ports.split_at(count);
        let (routes, monitors) = rest.split_at(count);
        let routes_text: Vec<_> = routes.iter().map(|port| format!("\"nats://127.0.0.1:{port}\"")).collect();
        for (index, (port, route)) in clients.iter().zip(routes).enumerate() {
            let store = folder.path().join(format!("store{index}"));
            let monitor = monitors[index];
            let mut config = format!(
                "server_name: n{index}\nlisten: \"127.0.0.1:{port}\"\nhttp: \"127.0.0.1:{monitor}\"\n{more}\n\
                 jetstream {{ store_dir: {store:?}, sync_interval: always, {of_stores} }}\n"
            );
            if count > 1 {
                let routes = routes_text.join(", ");
                config += &format!(
                    "cluster {{ name: c, listen: \"127.0.0.1:{route}\", routes: [{routes}], {of_cluster} }}\n"
                );
            }
            fs::write(folder.path().join(format!("{index}.conf")), config).unwrap();
        }
        let pairs = clients.iter().zip(monitors);
        let servers = pairs.map(|(&port, &monitor)| Server { port, monitor, process: None }).collect();
        let mut this = Self { folder, program: program.into(), servers };
        this.start_all();
        Some(this)
    }

    /// Starts those that do not run.
    pub(crate) fn start_all(&mut self) {
        for index in 0..self.servers.len() {
            self.start_one(index);
        }
    }

    /// Starts one, if it does not run.
    pub(crate) fn start_one(&mut self, index: usize) {
        if self.servers[index].process.is_some() {
            return;
        }
        let path = |ending: &str| self.folder.path().join(format!("{index}.{ending}"));
        let mut command = Command::new(&self.program);
        command.arg("-c").arg(path("conf")).arg("-l").arg(path("log")).stderr(Stdio::null());
        self.servers[index].process = Some(command.spawn().unwrap());
    }

    /// Kills one with -9.
    pub(crate) fn kill(&mut self, index: usize) {
        if let Some(mut process) = self.servers[index].process.take() {
            process.kill().unwrap();
            process.wait().unwrap();
        }
    }

    /// Sends one a signal, by its name.
    pub(crate) fn signal(&self, index: usize, name: &str) {
        let id = self.servers[index].process.as_ref().unwrap().id().to_string();
        assert!(Command::new("kill").args(["-s", name, &id]).status().unwrap().success());
    }

    /// The folder of a server's store.
    pub(crate) fn store(&self, index: usize) -> PathBuf {
        self.folder.path().join(format!("store{index}"))
    }

    /// Kills all with -9.
    pub(crate) fn kill_all(&mut self) {
        (0..self.servers.len()).for_each(|index| self.kill(index));
    }

    /// True once a server has all that its cluster has, by its own word.
    pub(crate) fn is_current(&self, index: usize) -> bool {
        let asked = || -> std::io::Result<String> {
            let mut connection = TcpStream::connect(("127.0.0.1", self.servers[index].monitor))?;
            connection.write_all(b"GET /healthz HTTP/1.0\r\n\r\n")?;
            let mut answer = String::new();
            connection.read_to_string(&mut answer).map(|_| answer)
        };
        asked().is_ok_and(|answer| answer.contains(" 200 "))
    }

    /// Copies the stores of servers that do not run.
    pub(crate) fn copy_stores(&self) -> TempDir {
        let copy = TempDir::new().unwrap();
        self.each_store(|store, name| copy_folder(store, &copy.path().join(name)));
        copy
    }

    /// Puts a copy of the stores in their place, while no server runs.
    pub(crate) fn put_back_stores(&self, copy: &TempDir) {
        self.each_store(|store, name| {
            fs::remove_dir_all(store).unwrap();
            copy_folder(&copy.path().join(name), store);
        });
    }

    fn each_store(&self, mut what: impl FnMut(&Path, &str)) {
        assert!(self.servers.iter().all(|server| server.process.is_none()), "servers run");
        for index in 0..self.servers.len() {
            let name = format!("store{index}");
            what(&self.folder.path().join(&name), &name);
        }
    }

    /// Ports of the servers.
    pub(crate) fn ports(&self) -> Vec<u16> {
        self.servers.iter().map(|server| server.port).collect()
    }

    /// Addresses of the servers.
    pub(crate) fn urls(&self) -> Vec<String> {
        self.servers.iter().map(|server| format!("nats://127.0.0.1:{}", server.port)).collect()
    }

    /// What a connection to them is made of.
    pub(crate) fn settings(&self) -> EngineSettings {
        EngineSettings {
            urls: self.urls(),
            credentials: Credentials::None,
            root_certificates: None,
            replicas: self.servers.len(),
            name: "test".to_owned(),
        }
    }

    /// A connection to them, once they serve.
    pub(crate) fn engine(&self) -> Engine {
        eventually(|| Engine::connect(&self.settings()))
    }
}

impl Drop for NatsServers {
    fn drop(&mut self) {
        self.kill_all();
    }
}

/// What a call gives once it succeeds.
#[track_caller]
pub(crate) fn eventually<T, E: std::fmt::Display>(mut call: impl FnMut() -> Result<T, E>) -> T {
    let begun = Instant::now();
    loop {
        match call() {
            Ok(given) => return given,
            Err(error) if begun.elapsed() > SERVING_WITHIN => panic!("{error}"),
            Err(_) => std::thread::sleep(Duration::from_millis(100)),
        }
    }
}

/// Ports that nobody listens at, and that were not given before: whoever got them may still be starting. They are none
/// of those that the kernel gives connections by itself: a server that is started again finds its own still free.
pub(crate) fn free_ports(count: usize) -> Vec<u16> {
    static GIVEN: Mutex<BTreeSet<u16>> = Mutex::new(BTreeSet::new());
    let mut given = GIVEN.lock().unwrap();
    let mut listeners = BTreeMap::new();
    while listeners.len() < count {
        // Seeded anew in each process, and with each.
        let number = RandomState::new().build_hasher().finish();
        let port = 10_000 + (number % 22_000) as u16;
        if !given.contains(&port)
            && let Ok(listener) = TcpListener::bind(("127.0.0.1", port))
        {
            listeners.insert(port, listener);
        }
    }
    given.extend(listeners.keys());
    listeners.into_keys().collect()
}

/// Copies a folder with all that is in it.
pub(crate) fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy_folder(&entry.path(), &to),
            false => drop(fs::copy(entry.path(), to).unwrap()),
        }
    }
}
