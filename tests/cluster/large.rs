//! Large changes and large maps: all nodes have them, as a server by itself has. It prints how long each took beside
//! such a server on the same disk. The long form has so much changed that bases are put and logs cut while a node is
//! away.
//!
//! ```text
//! MROL_CLUSTER_LARGE=1 NATS_SERVER_PROGRAM=$(.ci/nats-server) cargo test --release --test cluster large -- --nocapture
//! ```

use std::fs;
use std::thread::sleep;
use std::time::{Duration, Instant};

use bytes::Bytes;
use mrol::client::{Client, ClientError, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{MapContents, MapName, MapSettings, Region, RequestId, RobotName};
use mrol::mapping::Guess;
use mrol::service::{Deletion, DeletionTarget, ScanRequest};
use mrol::store::Snapshot;
use mrol::voxel::{VoxelKey, VoxelSet};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uuid::Uuid;

use crate::load::Load;
use crate::site::{MapState, NODES, Site};

/// The node that is a server by itself first, is away and comes back.
const OTHER: usize = 2;

/// Side of a voxel.
const RESOLUTION_M: f64 = 0.1;

/// Voxels between two that are scattered: each is alone in its block.
const APART: i32 = 8;

/// Scans that show something new. Thirty of a million scattered voxels each made nodes of 12 GB, and did not fill two
/// bases.
const PLACES: i32 = 3;

/// How long the large form waits for anything.
const PATIENCE: Duration = Duration::from_secs(300);

struct Sizes {
    is_long: bool,
    /// Voxels that are deleted at once, along each of three sides.
    scattered_side: i32,
    /// Points of a scan.
    points: i32,
    /// Voxels of a map that is restored, in so many planes of a thousand lines.
    planes: i32,
    lines: i32,
    /// How often a map is deleted and made again.
    again: u64,
}

impl Sizes {
    fn of_form() -> Self {
        match std::env::var_os("MROL_CLUSTER_LARGE").is_some() {
            true => Self {
                is_long: true,
                scattered_side: 200,
                points: 1_000_000,
                planes: 10,
                lines: 1_000,
                again: 200,
            },
            false => {
                Self { is_long: false, scattered_side: 64, points: 50_000, planes: 2, lines: 100, again: 6 }
            }
        }
    }

    fn scattered(&self) -> VoxelSet {
        let side = self.scattered_side;
        let key = |i: i32| VoxelKey::new([i % side, i / side % side, i / side / side].map(|k| APART * k));
        (0..side.pow(3)).filter_map(key).collect()
    }

    fn planes(&self) -> VoxelSet {
        let key =
            |i: i32| VoxelKey::new([i % 1_000, i / 1_000 % self.lines, APART * (i / 1_000 / self.lines)]);
        (0..1_000 * self.lines * self.planes).filter_map(key).collect()
    }

    /// Points in voxels of their own, each somewhere in another block, above all else: what lies in order takes no
    /// bytes of a log. The map grows by those of [`PLACES`] scans: later ones show the same again.
    fn scan(&self, number: i32) -> ScanRequest {
        let center = |k: i32| ((f64::from(k) + 0.5) * RESOLUTION_M) as f32;
        let place = number % PLACES;
        let mut random = ChaCha8Rng::seed_from_u64(place as u64);
        let mut within = |block: i32| center(APART * block + random.random_range(0..APART));
        let first = 1_700 / APART + 1;
        let point = |i: i32| Point::new(within(i % 1_000), within(i / 1_000), within(first + place));
        let points: Vec<Point> = (0..self.points).map(point).collect();
        ScanRequest {
            scan_id: Some(number as u64),
            guess: Guess::Pose(Pose::identity()),
            at_guess: true,
            ..ScanRequest::new(RobotName::new("surveyor").unwrap(), points.into())
        }
    }
}

fn name(text: &str) -> MapName {
    MapName::new(text).unwrap()
}

fn file_of(voxels: VoxelSet) -> Bytes {
    let settings = MapSettings::new(RESOLUTION_M, 6);
    let file = Snapshot { uuid: Uuid::new_v4(), settings, contents: MapContents::at(0, voxels) }.encode();
    file.unwrap().into()
}

/// Asks until it is answered, and says what it was told before.
#[track_caller]
fn done<T>(site: &Site, told: &mut Vec<String>, ask: impl AsyncFn() -> Result<T, ClientError>) -> T {
    let begun = Instant::now();
    loop {
        match site.runtime().block_on(ask()) {
            Ok(answer) => return answer,
            Err(error) => {
                told.push(error.reason().unwrap_or("lost").to_owned());
                assert!(begun.elapsed() < PATIENCE, "{error}");
                let may_be_told = ["no_quorum", "not_leader", "outcome_unknown", "draining", "starting"];
                assert!(may_be_told.contains(&error.reason().unwrap_or("lost")), "{error}");
            }
        }
        sleep(Duration::from_millis(20));
    }
}

/// Changes maps at those who serve them, and says how long each change took.
struct Changes<'a> {
    site: &'a Site,
    sizes: &'a Sizes,
    /// Clients of nodes, one after the other asked first.
    clients: Vec<Client>,
    /// What was refused or not known.
    told: Vec<String>,
    took: Vec<(&'static str, Duration)>,
}

impl<'a> Changes<'a> {
    fn at(site: &'a Site, sizes: &'a Sizes, nodes: &[usize]) -> Self {
        let client = |node: &usize| site.client(&site.grpc(*node)).with_timeout(PATIENCE);
        let clients = nodes.iter().map(client).collect();
        Self { site, sizes, clients, told: Vec::new(), took: Vec::new() }
    }

    fn timed<T>(&mut self, what: &'static str, change: impl FnOnce(&mut Self) -> T) -> T {
        let begun = Instant::now();
        let done = change(self);
        println!("{what}: {:.2?}", begun.elapsed());
        self.took.push((what, begun.elapsed()));
        done
    }

    fn client(&self, turn: u64) -> &Client {
        &self.clients[turn as usize % self.clients.len()]
    }

    fn restore(&mut self, what: &'static str, map: &str, file: &Bytes) {
        self.timed(what, |this| {
            let client = this.clients[0].clone();
            this.site.runtime().block_on(client.restore_map(&name(map), file.clone())).unwrap();
        });
    }

    /// Deletes all voxels of a map at once; how many.
    fn delete_all(&mut self, map: &str) -> usize {
        self.timed("all of them deleted", |this| {
            let deletion = Deletion {
                target: DeletionTarget::Region(Region::cuboid([-1e3; 3], [1e3; 3]).unwrap()),
                level: 0,
                request_id: Some(RequestId::new("all").unwrap()),
            };
            let client = this.client(1).clone();
            let ask = async || client.delete_voxels(&name(map), deletion.clone()).await;
            done(this.site, &mut this.told, ask).removed
        })
    }

    fn scan(&mut self, map: &str, number: i32) {
        let scan = self.sizes.scan(number);
        self.timed("a scan", |this| {
            let client = this.client(1).clone();
            done(this.site, &mut this.told, async || client.insert_scan(&name(map), scan.clone()).await);
        });
    }

    /// Deletes a map and makes it again, at one node after the other.
    fn make_again(&mut self, map: &str) {
        let scan = Sizes { points: 10, ..Sizes::of_form() }.scan(0);
        self.timed("a map deleted and made again", |this| {
            for round in 0..this.sizes.again {
                let (first, second) = (this.client(round).clone(), this.client(round + 1).clone());
                let site = this.site;
                let new = async || {
                    let new = NewMap { levels: Some(2), ..NewMap::of(RESOLUTION_M) };
                    first.create_map(&name(map), new).await
                };
                let made = done(site, &mut this.told, new).0;
                let inserted =
                    done(site, &mut this.told, async || second.insert_scan(&name(map), scan.clone()).await);
                assert_eq!(inserted.version.map_uuid, made.version.map_uuid, "round {round}");
                assert_eq!(inserted.version.revision, 1, "round {round}: it is a new map");
                done(site, &mut this.told, async || second.delete_map(&name(map)).await);
            }
        });
    }
}

/// Waits until nodes have a map as one has it, and says how long that took.
#[track_caller]
fn equal(site: &Site, nodes: &[usize], map: &str, is_so: impl Fn(&MapState) -> bool) -> Duration {
    let begun = Instant::now();
    loop {
        let states: Vec<_> = nodes.iter().map(|node| site.state(*node, &name(map))).collect();
        if states[0].as_ref().is_some_and(&is_so) && states.iter().all(|state| *state == states[0]) {
            return begun.elapsed();
        }
        assert!(begun.elapsed() < PATIENCE, "{map}: {states:?}");
        sleep(Duration::from_millis(20));
    }
}

/// Kilobytes of a node's process, by the name of the figure.
fn memory(site: &Site, node: usize, figure: &str) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", site.process(node))).unwrap();
    let line = status.lines().find(|line| line.starts_with(figure)).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[test]
fn large_changes_and_large_maps_are_on_all_nodes() {
    let Some(mut site) = Site::start() else { return };
    let sizes = Sizes::of_form();
    let (hall, scattered) = (file_of(sizes.planes()), file_of(sizes.scattered()));
    let count = sizes.scattered_side.pow(3) as usize;
    let of_hall = (1_000 * sizes.lines * sizes.planes) as usize;
    let after_scan = |state: &MapState| state.voxels == of_hall + sizes.points as usize;

    // A server by itself, on the same disk.
    site.end_node(OTHER);
    fs::remove_dir_all(site.data(OTHER)).unwrap();
    site.start_alone(OTHER, &[]);
    site.wait_until_ready(OTHER);
    let mut alone = Changes::at(&site, &sizes, &[OTHER]);
    alone.restore("a map restored", "hall", &hall);
    alone.restore("scattered voxels restored", "scattered", &scattered);
    assert_eq!(alone.delete_all("scattered"), count);
    alone.scan("hall", 0);
    alone.make_again("again");
    let alone = alone.took;
    site.kill_node(OTHER);
    fs::remove_dir_all(site.data(OTHER)).unwrap();

    // Two nodes have the map, one of them nothing else; and the third joins.
    let mut changes = Changes::at(&site, &sizes, &[0]);
    changes.restore("a map restored", "hall", &hall);
    let mut all = changes.took;
    let one = [0, 1];
    equal(&site, &one, "hall", |state| state.voxels == of_hall);
    site.end_node(1);
    site.start_node(1);
    site.wait_until_ready(1);
    let begun = Instant::now();
    site.start_node(OTHER);
    site.wait_until_ready(OTHER);
    let ready = [OTHER, 1].map(|node| site.state(node, &name("hall")).is_some_and(|it| it.voxels == of_hall));
    assert_eq!(ready, [true; 2], "a node is ready before it has the map");
    let joined = begun.elapsed();
    let (most, has) = (memory(&site, OTHER, "VmHWM"), memory(&site, 1, "VmRSS"));
    println!(
        "joined within {joined:.1?}; {} MiB at most, and {} MiB of a node that has it",
        most >> 10,
        has >> 10
    );
    let three: Vec<usize> = (0..NODES).collect();
    equal(&site, &three, "hall", |state| state.voxels == of_hall);
    if sizes.is_long {
        assert!(joined < Duration::from_secs(30), "{joined:?}");
        assert!(most * 10 <= has * 18, "{most} kB, where a node that has the map takes {has}");
    }

    let mut changes = Changes::at(&site, &sizes, &three);
    changes.restore("scattered voxels restored", "scattered", &scattered);
    equal(&site, &three, "scattered", |state| state.voxels == count);
    assert_eq!(changes.delete_all("scattered"), count);
    println!(
        "deleted at all nodes after {:.1?}",
        equal(&site, &three, "scattered", |state| state.voxels == 0)
    );
    changes.scan("hall", 0);
    println!("inserted at all nodes after {:.1?}", equal(&site, &three, "hall", after_scan));
    site.create(&name("busy"));
    let load = Load::begin(&site, &name("busy"));
    load.wait_for(5);
    changes.make_again("again");
    load.wait_for(5);
    let scans = load.end(&site).0;
    equal(&site, &three, "busy", |state| (state.scans, state.voxels) == (scans, scans));
    println!("told meanwhile: {:?}", changes.told);
    all.extend(changes.took);
    println!("{:>30} {:>10} {:>10}", "what", "alone", "nodes");
    for ((what, alone), (_, all)) in alone.iter().zip(&all) {
        println!("{what:>30} {:>8.2} s {:>8.2} s", alone.as_secs_f64(), all.as_secs_f64());
    }
    if sizes.is_long {
        behind_the_log(&mut site, &sizes, of_hall);
    }
}

/// So much is changed while a node is stopped that its place in the log is cut off; it is killed while it loads the
/// base.
fn behind_the_log(site: &mut Site, sizes: &Sizes, of_hall: usize) {
    site.signal(OTHER, "STOP");
    let two = [0, 1];
    let said = |site: &Site| {
        two.iter().map(|node| site.all_log_of(*node).matches("a base was put").count()).sum::<usize>()
    };
    let mut number = 0;
    let begun = Instant::now();
    // The first base cuts nothing off.
    while said(site) < 2 {
        number += 1;
        let mut changes = Changes::at(site, sizes, &two);
        changes.scan("hall", number);
        assert!(begun.elapsed() < 3 * PATIENCE, "{number} scans, and no base");
    }
    println!("two bases were put within {number} scans and {:.0?}", begun.elapsed());
    let all = of_hall + PLACES.min(number + 1) as usize * sizes.points as usize;
    let is_all = |state: &MapState| (state.voxels, state.scans) == (all, number as usize + 1);
    site.signal(OTHER, "CONT");
    let begun = Instant::now();
    while !site.all_log_of(OTHER).contains("this node's copy is behind") {
        assert!(begun.elapsed() < PATIENCE, "{}", site.log_of(OTHER));
        sleep(Duration::from_millis(20));
    }
    // The base has begun to come, or is there.
    sleep(Duration::from_secs(2));
    site.kill_node(OTHER);
    site.start_node(OTHER);
    site.wait_until_ready(OTHER);
    println!("a node that was behind is ready after {:.1?}", begun.elapsed());
    equal(site, &[0, 1, OTHER], "hall", is_all);
}
