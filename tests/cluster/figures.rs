//! What a cluster costs beside a server by itself, on the same disk and at the same time.
//!
//! ```text
//! NATS_SERVER_PROGRAM=$(.ci/nats-server) cargo test --release --test cluster figures -- --ignored --nocapture
//! ```

use std::fs;
use std::time::{Duration, Instant};

use mrol::client::{Client, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{Lookup, MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::{PointQuery, ScanRequest};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::site::{NODES, Site};

/// Scans of each kind of measurement.
const SCANS: usize = 300;
/// Points of a scan.
const POINTS: usize = 20_000;
/// Time between scans where the lag is measured.
const SCAN_EVERY: Duration = Duration::from_millis(50);
/// Questions of a comparison, and points of each.
const QUESTIONS: usize = 100;
const ASKED: usize = 100_000;

/// One server, as it is measured.
struct Measured {
    client: Client,
    process: u32,
}

#[test]
#[ignore = "prints figures, in a minute or two"]
fn figures_of_a_cluster() {
    let Some(site) = Site::start() else { return };
    let map = MapName::new("hall").unwrap();
    // Of the resolution of a building, in place of the faults' half meter.
    let new_map = NewMap::of(0.1);
    let client = site.client(&site.all_grpc(0));
    site.runtime().block_on(client.create_map(&map, new_map)).unwrap();
    let leader = site.leader(&map);
    let [follower, unasked] = [1, 2].map(|further| (leader + further) % NODES);
    let server = site.start_beside();
    let alone = Measured { client: site.client(&server.grpc), process: server.id() };
    site.runtime().block_on(alone.client.create_map(&map, new_map)).unwrap();
    let measured =
        |site: &Site, node| Measured { client: site.client(&site.grpc(node)), process: site.process(node) };
    let [leading, following, unasked] = [leader, follower, unasked].map(|node| measured(&site, node));

    // One after the other, so that whatever else the machine does falls on both.
    let (mut by_alone, mut by_leader, mut by_follower) = (Vec::new(), Vec::new(), Vec::new());
    for number in 0..SCANS {
        by_alone.push(insert(&site, &alone, &map, number * 2).0);
        by_alone.push(insert(&site, &alone, &map, number * 2 + 1).0);
        by_leader.push(insert(&site, &leading, &map, number * 2).0);
        by_follower.push(insert(&site, &following, &map, number * 2 + 1).0);
    }
    print("a scan of 20,000 points, acknowledged by a server by itself", &mut by_alone);
    print("by the node that leads", &mut by_leader);
    print("by a follower, which asks the one that leads", &mut by_follower);

    let (mut lags, mut looks) = (Vec::new(), Vec::new());
    let cpu = [&alone, &leading, &following, &unasked].map(|it| cpu_time(it.process));
    let begun = Instant::now();
    for number in 0..SCANS {
        let (_, revision) = insert(&site, &leading, &map, SCANS * 2 + number);
        lags.push(look(&site, &following, &map, Some(revision)));
        looks.push(look(&site, &following, &map, None));
        let next = SCAN_EVERY * (number as u32 + 1);
        std::thread::sleep(next.saturating_sub(begun.elapsed()));
    }
    let took = begun.elapsed();
    let used =
        |before: Duration, it: &Measured| (cpu_time(it.process) - before).as_secs_f64() * 1e3 / SCANS as f64;
    println!(
        "{SCANS} scans in {:.1} s (goal {:.1})",
        took.as_secs_f64(),
        (SCAN_EVERY * SCANS as u32).as_secs_f64()
    );
    println!(
        "processor time a scan, with beats: leader {:.2} ms, follower {:.2} ms, with two looks {:.2} ms; a server that rests {:.2} ms",
        used(cpu[1], &leading),
        used(cpu[3], &unasked),
        used(cpu[2], &following),
        used(cpu[0], &alone)
    );
    print("a follower has an acknowledged scan after, with the time of a look", &mut lags);
    print("a look alone", &mut looks);

    // It has the same map then.
    (0..SCANS).for_each(|number| _ = insert(&site, &alone, &map, SCANS * 2 + number));
    for (name, it) in [
        ("a server by itself", &alone),
        ("a follower", &following),
        ("a server by itself", &alone),
        ("a follower", &following),
    ] {
        let (before, begun) = (cpu_time(it.process), Instant::now());
        for number in 0..QUESTIONS {
            ask(&site, it, &map, number);
        }
        let million = (QUESTIONS * ASKED) as f64 / 1e6;
        let cpu = (cpu_time(it.process) - before).as_secs_f64() * 1e3 / million;
        let wall = begun.elapsed().as_secs_f64() * 1e3 / million;
        println!("{name}: {cpu:.2} ms of processor time a million points asked, {wall:.2} ms by the clock");
    }
}

/// A scan at its place, of points that the last had too, but for some: how long until it is acknowledged, and the
/// revision.
fn insert(site: &Site, at: &Measured, map: &MapName, number: usize) -> (Duration, u64) {
    let robot = RobotName::new("robot").unwrap();
    let scan = ScanRequest {
        scan_id: Some(number as u64),
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(robot, points(number, POINTS).into())
    };
    let begun = Instant::now();
    let answer = site.runtime().block_on(at.client.insert_scan(map, scan)).unwrap();
    (begun.elapsed(), answer.version.revision)
}

/// A wall of a corridor, as far along as the scan is.
fn points(number: usize, count: usize) -> Vec<Point> {
    let mut random = StdRng::seed_from_u64(number as u64);
    let along = number as f32 * 0.1;
    let point = |random: &mut StdRng| {
        let x = along + random.random_range(0.0..20.0_f32);
        Point::new(x, if random.random() { 0.0 } else { 3.0 }, random.random_range(0.0..2.5))
    };
    (0..count).map(|_| point(&mut random)).collect()
}

fn look(site: &Site, at: &Measured, map: &MapName, min_revision: Option<u64>) -> Duration {
    let begun = Instant::now();
    question(site, at, map, vec![Point::new(0.5, 0.0, 0.5)], min_revision);
    begun.elapsed()
}

fn ask(site: &Site, at: &Measured, map: &MapName, number: usize) {
    question(site, at, map, points(number, ASKED), None);
}

fn question(site: &Site, at: &Measured, map: &MapName, points: Vec<Point>, min_revision: Option<u64>) {
    let query = PointQuery {
        points: points.into(),
        map_from_points: None,
        level: 0,
        lookup: Lookup::Exact,
        min_revision,
        map_uuid: None,
        keep_out: false,
    };
    site.runtime().block_on(at.client.query_points(map, query)).unwrap();
}

/// Processor time that a process has used, in user mode and in the kernel.
fn cpu_time(process: u32) -> Duration {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let fields: Vec<u64> = stat
        .rsplit(')')
        .next()
        .unwrap()
        .split_whitespace()
        .skip(11)
        .take(2)
        .map(|it| it.parse().unwrap())
        .collect();
    // The kernel counts in hundredths of a second for programs.
    Duration::from_millis(10 * fields.iter().sum::<u64>())
}

fn print(what: &str, times: &mut [Duration]) {
    times.sort();
    let at = |percent: usize| times[(times.len() * percent / 100).min(times.len() - 1)].as_secs_f64() * 1e3;
    println!("{what}: p50 {:.2} ms, p99 {:.2} ms", at(50), at(99));
}
