//! Programs in C and C++, compiled against both libraries, with a real server: `clients/c/check` builds what they need.

#![expect(clippy::unwrap_used, reason = "all of it is a test")]

mod cpp;
mod planning;

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use mrol_client::geometry::{Point, Pose};
use mrol_client::map::{KeepOutName, KeepOutShape, Lookup, MapName, Region, RobotName};
use mrol_client::mapping::Guess;
use mrol_client::service::{PointQuery, PutKeepOut, ScanRequest};
use mrol_client::{Client, Credentials, NewMap};

/// How long anything may take before a test gives up.
const PATIENCE: Duration = Duration::from_secs(30);

/// Libraries that the static library needs of the system.
const SYSTEM: [&str; 4] = ["-lpthread", "-ldl", "-lm", "-lrt"];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Linked {
    Statically,
    /// With the address sanitizer, which sees the library's allocations too, and leaks.
    Sanitized,
    Dynamically,
}

/// A folder of this run.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Where cargo puts what it builds.
fn built() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.parent().and_then(Path::parent).unwrap().to_owned()
}

/// Compiles `tests/SOURCE` without a warning, once for all tests.
fn compile(source: &str, linked: Linked) -> Command {
    static COMPILED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let programs = Path::new(env!("CARGO_TARGET_TMPDIR")).join("programs");
    std::fs::create_dir_all(&programs).unwrap();
    let program = programs.join(format!("{}-{linked:?}", source.replace(['.', '/'], "-")));
    let mut compiled = COMPILED.lock().unwrap();
    if compiled.insert(program.clone()) {
        compile_to(source, linked, &program);
    }
    Command::new(program)
}

fn compile_to(source: &str, linked: Linked, program: &Path) {
    compile_file(&Path::new("tests").join(source), linked, program);
}

/// Compiles a file of C or C++, warnings being errors.
fn compile_file(source: &Path, linked: Linked, program: &Path) {
    let is_c = source.extension().is_some_and(|extension| extension == "c");
    let (compiler, standard) = if is_c { ("cc", "c99") } else { ("c++", "c++17") };
    let mut command = Command::new(compiler);
    command.arg(format!("-std={standard}"));
    command.args(["-Wall", "-Wextra", "-Werror", "-pedantic", "-g", "-Iinclude", "-I../cpp/include"]);
    if linked == Linked::Sanitized {
        command.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]);
    }
    command.arg(source).arg("-o").arg(program);
    let libraries = built();
    match linked {
        Linked::Statically | Linked::Sanitized => {
            command.arg(libraries.join("libmrol_replica.a")).args(SYSTEM);
        }
        Linked::Dynamically => {
            command.arg("-L").arg(&libraries).arg("-lmrol_replica");
            command.arg(format!("-Wl,-rpath,{}", libraries.display()));
        }
    }
    let compiled = command.current_dir(env!("CARGO_MANIFEST_DIR")).status().expect("a compiler");
    assert!(compiled.success(), "{command:?}");
}

/// A server in a process of its own.
struct Server {
    process: Child,
    grpc: String,
    data: PathBuf,
}

impl Server {
    fn start(name: &str) -> Self {
        Self::start_at(folder(name), "127.0.0.1:0")
    }

    fn start_at(data: PathBuf, address: &str) -> Self {
        Self::start_with(data, address, &[])
    }

    fn start_with(data: PathBuf, address: &str, options: &[&str]) -> Self {
        let program = std::env::var_os("MROL_PROGRAM").map_or_else(|| built().join("mrol"), PathBuf::from);
        let mut process = Command::new(program)
            .args(["serve", "--json", "--log-level", "error", "--http-listen", "127.0.0.1:0"])
            .args(["--grpc-listen", address, "--data-dir"])
            .arg(&data)
            .args(options)
            .env("MROL_LOG__AUDIT", "false")
            .stdout(Stdio::piped())
            .spawn()
            .expect("the server's program: clients/c/check builds it");
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let rest = line.split("\"grpc\":\"").nth(1).expect("a line that says where it serves");
        let grpc = format!("http://{}", rest.split('"').next().unwrap());
        Self { process, grpc, data }
    }

    /// `kill -9`, and the same server again.
    fn kill_and_start(mut self) -> Self {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
        let (data, address) = (self.data.clone(), self.grpc.replace("http://", ""));
        std::mem::forget(self);
        Self::start_at(data, &address)
    }

    async fn client(&self) -> Client {
        Client::connect(&self.grpc).await.unwrap()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
        let _ = std::fs::remove_dir_all(&self.data);
    }
}

fn map() -> MapName {
    MapName::new("a").unwrap()
}

/// Centers of `count` voxels of 0.1 m in a row along x.
fn row(count: usize) -> Vec<Point> {
    (0..count).map(|i| Point::new(i as f32 * 0.1 + 0.05, 0.05, 0.05)).collect()
}

async fn make_map(client: &Client) {
    let settings = NewMap { levels: Some(4), ..NewMap::of(0.1) };
    client.create_map(&map(), settings).await.unwrap();
}

/// Puts a scan in; its revision.
async fn insert(client: &Client, points: Vec<Point>) -> u64 {
    let scan = ScanRequest {
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("r").unwrap(), points.into())
    };
    client.insert_scan(&map(), scan).await.unwrap().version.revision
}

/// A program that reads commands, at work.
struct Driver {
    process: Child,
    commands: ChildStdin,
    lines: BufReader<ChildStdout>,
}

impl Driver {
    fn start(source: &str, linked: Linked) -> Self {
        let mut program = compile(source, linked);
        let mut process = program.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (commands, lines) = (process.stdin.take().unwrap(), process.stdout.take().unwrap());
        Self { process, commands, lines: BufReader::new(lines) }
    }

    fn told(&mut self, command: &str) -> String {
        writeln!(self.commands, "{command}").unwrap();
        let mut line = String::new();
        self.lines.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    }

    fn does(&mut self, command: &str) {
        assert_eq!(self.told(command), "ok", "{command}");
    }

    /// Asks again until the line says so.
    fn until(&mut self, command: &str, so: impl Fn(&str) -> bool) -> String {
        let begin = Instant::now();
        loop {
            let line = self.told(command);
            if so(&line) {
                return line;
            }
            assert!(begin.elapsed() < PATIENCE, "{command}: {line}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn end(mut self) {
        drop(self.commands);
        assert!(self.process.wait().unwrap().success());
    }
}

/// A question, and the line with which the driver answers it where it answers as gRPC does.
async fn question(client: &Client, query: PointQuery) -> (String, String) {
    let lookup = u8::from(query.lookup == Lookup::Bloom);
    let pose = query.map_from_points.map_or("-".to_owned(), |pose| {
        let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
        numbers.map(f64::to_string).collect::<Vec<_>>().join(" ")
    });
    let keep_out = u8::from(query.keep_out);
    let mut command = format!("query {} {lookup} {keep_out} {pose} {}", query.level, query.points.len());
    for [x, y, z] in query.points.as_slice().iter().map(|point| point.xyz()) {
        command += &format!(" {x} {y} {z}");
    }
    let answer = client.query_points(&map(), query).await.unwrap();
    let bits: String = answer.occupied.iter().map(|byte| format!("{byte:02x}")).collect();
    let version = answer.version;
    let line = format!(
        "{} {} {:016x} {} {} {bits}",
        version.map_uuid.simple(),
        version.revision,
        version.content_hash.unwrap().to_bits(),
        answer.points,
        answer.points_occupied
    );
    (command, line)
}

/// Compares answers at every level, by both look-ups, with and without keep-outs and a pose.
async fn compare(driver: &mut Driver, client: &Client) {
    let turned = mrol_client::geometry::pose([0.31, -0.07, 0.02], [0.0, 0.0, 0.6, 0.8]).unwrap();
    let points: Vec<Point> =
        (0..203).map(|i| Point::new((i % 29) as f32 * 0.07, (i / 29) as f32 * 0.05, 0.05)).collect();
    for level in 0..4 {
        for (lookup, keep_out) in [(Lookup::Exact, false), (Lookup::Bloom, false), (Lookup::Exact, true)] {
            for map_from_points in [None, Some(turned)] {
                let points = points.clone().into();
                let query = PointQuery {
                    points,
                    map_from_points,
                    level,
                    lookup,
                    min_revision: None,
                    map_uuid: None,
                    keep_out,
                };
                let (command, line) = question(client, query).await;
                assert_eq!(driver.told(&command), line, "level {level}, {lookup:?}");
            }
        }
    }
}

async fn a_c_program_answers_as_grpc_does(linked: Linked) {
    let server = Server::start(&format!("answers-{linked:?}"));
    let client = server.client().await;
    make_map(&client).await;
    insert(&client, row(5)).await;
    let mut driver = Driver::start("driver.c", linked);
    driver.does(&format!("open {} a 1", server.grpc));
    compare(&mut driver, &client).await;
    let revision = insert(&client, row(19)).await;
    driver.does(&format!("wait {revision} 20000"));
    compare(&mut driver, &client).await;
    let version = driver.told("version");
    let [uuid, _, hash] = version.split(' ').collect::<Vec<_>>()[..] else { panic!("{version}") };
    assert_eq!(version, format!("{uuid} {revision} {hash}"));

    let ball = KeepOutShape::of_region(Region::ball([0.4, 0.3, 0.05], 0.16).unwrap()).unwrap();
    let name = KeepOutName::new("crate").unwrap();
    let put = PutKeepOut { name, shape: ball, expires_at_ns: None, request_id: None };
    let revision = client.put_keep_out(&map(), put).await.unwrap().version.revision;
    driver.does(&format!("wait {revision} 20000"));
    compare(&mut driver, &client).await;

    // Killed, the server is missed; the copy answers, and goes on without a reset when it is back.
    let server = server.kill_and_start();
    let client = server.client().await;
    driver.until("status", |line| line.contains("connected=1"));
    compare(&mut driver, &client).await;
    let revision = insert(&client, row(30)).await;
    driver.does(&format!("wait {revision} 20000"));
    compare(&mut driver, &client).await;
    let status = driver.told("status");
    assert!(status.contains(&format!(" head={revision} resets=1 connected=1")), "{status}");
    drop(server);
    driver.until("status", |line| line.contains("connected=0") && line.contains("127.0.0.1"));
    driver.does("close");
    assert!(driver.told("status").starts_with("MROL_CLOSED"));
    driver.end();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_program_with_the_static_library_answers_as_grpc_does() {
    a_c_program_answers_as_grpc_does(Linked::Statically).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_program_with_the_shared_library_answers_as_grpc_does() {
    a_c_program_answers_as_grpc_does(Linked::Dynamically).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_program_under_the_address_sanitizer_answers_as_grpc_does() {
    a_c_program_answers_as_grpc_does(Linked::Sanitized).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_copy_of_a_region_refuses_what_lies_outside() {
    let server = Server::start("region");
    let client = server.client().await;
    make_map(&client).await;
    insert(&client, row(19)).await;
    let mut driver = Driver::start("driver.c", Linked::Dynamically);
    driver.does(&format!("open {} a 0 0 -1 -1 1 1 1", server.grpc));
    let inside = driver.told("query 0 1 0 - 2 0.55 0.05 0.05 0.55 0.55 0.05");
    let [_, revision, hash, asked, positive, bits] = inside.split(' ').collect::<Vec<_>>()[..] else {
        panic!("{inside}")
    };
    assert_eq!([revision, hash, asked, positive, bits], ["1", "-", "2", "1", "01"]);
    let outside = driver.told("query 0 0 0 - 2 0.55 0.05 0.05 1.55 0.05 0.05");
    assert!(outside.starts_with("MROL_INVALID_ARGUMENT point_out_of_range: points[1]"), "{outside}");
    driver.end();
}

/// Changes the keys of a file, by the server's program; what it prints.
fn change_keys(arguments: &[&str], file: &Path) -> String {
    let program = std::env::var_os("MROL_PROGRAM").map_or_else(|| built().join("mrol"), PathBuf::from);
    let output = Command::new(program).arg("key").args(arguments).arg("--file").arg(file).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_replica_whose_key_is_revoked_says_so_gives_up_and_answers_up_to_the_age_allowed() {
    let data = folder("revoked");
    let keys = data.join("keys.toml");
    let operator = change_keys(&["new", "--name", "operator", "--scope", "admin"], &keys);
    let reader = change_keys(&["new", "--name", "reader", "--scope", "read"], &keys);
    let options = ["--keys-file", keys.to_str().unwrap()];
    let server = Server::start_with(data.clone(), "127.0.0.1:0", &options);
    let credentials = Credentials::default().with_key(&operator).unwrap();
    let client = Client::connect_with(&server.grpc, &credentials).await.unwrap();
    make_map(&client).await;
    insert(&client, row(3)).await;
    let mut driver = Driver::start("driver.c", Linked::Dynamically);
    driver.does(&format!("open_with_key {} a {reader} 1000000", server.grpc));
    assert!(driver.told("status").contains("connected=1 ended=0 young"));
    driver.does("check_age 60000");
    change_keys(&["revoke", "--name", "reader"], &keys);
    // It is refused a few times, and asks no more.
    let status = driver.until("status", |line| line.contains("connected=0 ended=1"));
    assert!(status.contains("bad_key") || status.contains("key"), "{status}");
    let point = "query 0 0 0 - 1 0.05 0.05 0.05";
    assert!(driver.told(point).ends_with(" 1 1 01"));
    let refused = driver.told("check_age 1");
    assert!(refused.starts_with("MROL_STALE replica_stale: the server was heard"), "{refused}");
    // Another one answers nothing that is older than its options allow.
    let writer = change_keys(&["new", "--name", "other", "--scope", "read"], &keys);
    let mut strict = Driver::start("driver.c", Linked::Dynamically);
    let begin = Instant::now();
    while strict.told(&format!("open_with_key {} a {writer} 1500", server.grpc)) != "ok" {
        assert!(begin.elapsed() < PATIENCE, "the new key is not known");
        std::thread::sleep(Duration::from_millis(50));
    }
    drop(server);
    let refused = strict.until(point, |line| line.starts_with("MROL_STALE"));
    assert!(refused.contains("replica_stale") && refused.contains("age_max is 1.5s"), "{refused}");
    strict.end();
    driver.end();
}

/// Runs a program that checks by itself.
async fn checks(source: &str, linked: Linked) {
    let server = Server::start(&format!("{}-{linked:?}", source.replace('.', "-")));
    let client = server.client().await;
    make_map(&client).await;
    insert(&client, row(3)).await;
    let output = compile(source, linked).args([&server.grpc, "a"]).output().unwrap();
    let [said, complained] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(output.status.success() && said == "ok\n", "{said}{complained}");
}

#[tokio::test(flavor = "multi_thread")]
async fn damaged_arguments_are_codes_in_c() {
    for linked in [Linked::Sanitized, Linked::Dynamically] {
        checks("hostile.c", linked).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn threads_ask_a_replica_that_is_closed_in_cpp() {
    for linked in [Linked::Statically, Linked::Dynamically] {
        checks("threads.cpp", linked).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_examples_ask_about_a_point() {
    let server = Server::start("examples");
    let client = server.client().await;
    make_map(&client).await;
    insert(&client, row(3)).await;
    let example = |program: &mut Command| {
        let output = program.args([&server.grpc, "a", "0.15", "0.05", "0.05", "--once"]).output().unwrap();
        let [said, complained] =
            [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert!(output.status.success() && said == "revision 1: occupied\n", "{said}{complained}");
    };
    example(&mut compile("../examples/follow.c", Linked::Dynamically));
    if Command::new("python3").arg("--version").output().is_err() {
        eprintln!("skipped: python3 is not there, which runs examples/follow.py");
        return;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut python = Command::new("python3");
    example(python.arg(folder.join("examples/follow.py")).arg(built().join("libmrol_replica.so")));
    let mut python = Command::new("python3");
    let motions = ["0.1", "0.15", "1.05", "0.05", "0.15", "0.5", "0.05", "0.15", "-0.5", "0.05"];
    python.arg(folder.join("examples/motions.py")).arg(built().join("libmrol_replica.so"));
    let output = python.args([&server.grpc, "a"]).args(motions).output().unwrap();
    let [said, complained] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    let expected = "[0.15, 1.05, 0.05] to [0.15, 0.5, 0.05]: free\n\
                    [0.15, 0.5, 0.05] to [0.15, -0.5, 0.05]: met after 33% of the way\n";
    assert!(output.status.success() && said == expected, "{said}{complained}");
}
