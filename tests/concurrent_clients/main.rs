//! Eight clients at once, over both protocols, on overlapping regions of one map: what they were told is what a
//! serial replay gives.
//!
//! Runs for `MROL_STRESS_SECONDS` (3 where not set; CI takes 60). With the feature `deadlock_detection` it fails as
//! soon as threads wait for each other in a circle; without, once nothing has moved for a while.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod newcomers;
#[path = "../support/mod.rs"]
mod support;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use mrol::client::Client;
use mrol::geometry::{self, Point, Pose};
use mrol::map::{
    Lookup, MapName, MapSettings, MappedScan, MultiResolutionMap, Region, RobotName, ScanRecord,
};
use mrol::mapping::Guess;
use mrol::service::{Deletion, DeletionTarget, ListingRequest, PointQuery, ScanRequest};
use mrol::voxel::{VoxelKey, VoxelSet};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use crate::support::daemon::{Daemon, json_of};
use crate::support::watchdog::{Beat, Watchdog};

const MAP: &str = "shared";
const RESOLUTION_M: f64 = 0.1;
const LEVELS: u32 = 4;
/// How long nothing may happen.
const STILL_MAX: Duration = Duration::from_secs(20);

/// What a client did and was told.
enum Event {
    Inserted { points: Vec<Point>, map_from_sensor: Pose, new_voxels: usize },
    Deleted { deletion: Deletion, removed: usize },
    Queried { points: Vec<Point>, level: u32, occupied: Vec<bool> },
}

/// What happened, by the revision it reported.
type History = Vec<(u64, Event)>;

fn seconds() -> u64 {
    std::env::var("MROL_STRESS_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(3)
}

/// A wall, a floor and some clutter, as a sensor near `center` would see it: all clients overlap.
fn scan(random: &mut ChaCha8Rng) -> Vec<Point> {
    let point = |i: usize, random: &mut ChaCha8Rng| {
        let (u, v) = (random.random_range(-4.0..4.0f32), random.random_range(0.0..2.5f32));
        match i % 4 {
            0 => Point::new(u, 4.0, v),
            1 => Point::new(-4.0, u, v),
            2 => Point::new(u, random.random_range(-4.0..4.0), 0.0),
            _ => Point::new(u.round(), (u * 1.7).round(), v),
        }
    };
    (0..1500).map(|i| point(i, random)).collect()
}

fn questions(random: &mut ChaCha8Rng) -> Vec<Point> {
    let mut points = scan(random);
    points.truncate(random.random_range(1..400));
    points
}

fn deletion(random: &mut ChaCha8Rng) -> Deletion {
    let at = [random.random_range(-4.0..4.0), random.random_range(-4.0..4.0), random.random_range(0.0..2.5)];
    let level = random.random_range(0..LEVELS);
    let target = match random.random_range(0..4) {
        0 => DeletionTarget::Region(Region::ball(at, 0.7).unwrap()),
        1 => DeletionTarget::Region(Region::cuboid(at, at.map(|c| c + 0.8)).unwrap()),
        2 => {
            let index = at.map(|c| (c / RESOLUTION_M).floor() as i32 >> level);
            DeletionTarget::Keys(vec![VoxelKey::new(index).unwrap()])
        }
        _ => DeletionTarget::Points(questions(random).into()),
    };
    Deletion { target, level, request_id: None }
}

/// A pose near the origin: scans are put in there, or aligned from there.
fn guess(random: &mut ChaCha8Rng) -> Pose {
    let shift = std::array::from_fn(|_| random.random_range(-0.3..0.3));
    geometry::pose(shift, [0.0, 0.0, 0.0, 1.0]).unwrap()
}

/// One client over gRPC.
async fn grpc_client(url: String, seed: u64, end: Instant, heart: Beat) -> History {
    let client = Client::connect(&url).await.expect("a connection");
    let map = MapName::new(MAP).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut history = History::new();
    let mut scan_id = 0;
    while Instant::now() < end {
        heart.beat();
        let event = match random.random_range(0..10) {
            0..3 => {
                scan_id += 1;
                let points = scan(&mut random);
                let request = ScanRequest {
                    scan_id: Some(scan_id),
                    guess: Guess::Pose(guess(&mut random)),
                    at_guess: random.random_bool(0.5),
                    strict: true,
                    ..ScanRequest::new(RobotName::new(&format!("g{seed}")).unwrap(), points.clone().into())
                };
                let answer = client.insert_scan(&map, request).await.expect("an insertion");
                if !answer.accepted || answer.stationary {
                    continue;
                }
                let (map_from_sensor, new_voxels) = (answer.map_from_sensor, answer.new_voxels);
                (answer.version.revision, Event::Inserted { points, map_from_sensor, new_voxels })
            }
            3..5 => {
                let deletion = deletion(&mut random);
                let answer = client.delete_voxels(&map, deletion.clone()).await.expect("a deletion");
                (answer.version.revision, Event::Deleted { deletion, removed: answer.removed })
            }
            _ => {
                let (points, level) = (questions(&mut random), random.random_range(0..LEVELS));
                let query = PointQuery {
                    points: points.clone().into(),
                    map_from_points: None,
                    level,
                    lookup: Lookup::Exact,
                    min_revision: None,
                    map_uuid: None,
                    keep_out: false,
                };
                let answer = client.query_points(&map, query).await.expect("an answer");
                let bit = |i: usize| answer.occupied[i / 8] >> (i % 8) & 1 == 1;
                let occupied = (0..points.len()).map(bit).collect();
                (answer.version.revision, Event::Queried { points, level, occupied })
            }
        };
        history.push(event);
    }
    history
}

/// One client over HTTP.
async fn http_client(base: String, seed: u64, end: Instant, heart: Beat) -> History {
    let client = reqwest::Client::new();
    let post = |path: &str, body: serde_json::Value| {
        let request = client.post(format!("{base}/v1/maps/{MAP}/{path}")).json(&body);
        async move {
            let answer = request.send().await.expect("an answer");
            assert_eq!(answer.status(), 200);
            json_of(answer).await
        }
    };
    let coordinates = |points: &[Point]| points.iter().map(|point| point.xyz()).collect::<Vec<_>>();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut history = History::new();
    let mut scan_id = 0;
    while Instant::now() < end {
        heart.beat();
        let event = match random.random_range(0..10) {
            0..3 => {
                scan_id += 1;
                let points = scan(&mut random);
                let guess = guess(&mut random);
                let body = json!({
                    "robot": format!("h{seed}"), "scan_id": scan_id, "points": coordinates(&points),
                    "guess": {"translation_m": geometry::translation_m(&guess), "rotation_xyzw": [0, 0, 0, 1]},
                    "align": random.random_bool(0.5),
                });
                let answer = post("scans", body).await;
                if answer["accepted"] == false {
                    continue;
                }
                let numbers = |field: &str| -> Vec<f64> {
                    serde_json::from_value(answer["map_from_sensor"][field].clone()).expect("numbers")
                };
                let translation = numbers("translation_m").try_into().expect("three");
                let rotation = numbers("rotation_xyzw").try_into().expect("four");
                let map_from_sensor = geometry::pose(translation, rotation).expect("a pose");
                let new_voxels = answer["new_voxels"].as_u64().expect("a count") as usize;
                (answer["revision"].as_u64(), Event::Inserted { points, map_from_sensor, new_voxels })
            }
            3..5 => {
                let points = questions(&mut random);
                let answer = post("deletions", json!({"points": coordinates(&points), "level": 1})).await;
                let removed = answer["removed"].as_u64().expect("a count") as usize;
                let deletion =
                    Deletion { target: DeletionTarget::Points(points.into()), level: 1, request_id: None };
                (answer["revision"].as_u64(), Event::Deleted { deletion, removed })
            }
            _ => {
                let (points, level) = (questions(&mut random), random.random_range(0..LEVELS));
                let answer = post("occupancy", json!({"points": coordinates(&points), "level": level})).await;
                let occupied = serde_json::from_value(answer["occupied"].clone()).expect("a list");
                (answer["revision"].as_u64(), Event::Queried { points, level, occupied })
            }
        };
        history.push((event.0.expect("a revision"), event.1));
    }
    history
}

/// Does again what an acknowledged change did; what it changed.
fn replay(map: &MultiResolutionMap, event: &Event) -> usize {
    match event {
        Event::Inserted { points, map_from_sensor, .. } => {
            let (voxels, _) = VoxelSet::of_points(points, &map.lattice().from_points(map_from_sensor));
            let pose = MappedScan::new(RobotName::new("replay").unwrap(), *map_from_sensor);
            map.committer().insert_scan(ScanRecord::of_voxels(pose, voxels)).added
        }
        Event::Deleted { deletion, .. } => {
            let view = map.view();
            let keys: Vec<VoxelKey> = match &deletion.target {
                DeletionTarget::Points(points) => {
                    let quantize = map.lattice().from_map();
                    let key = |&point: &Point| quantize.key(point).unwrap().ancestor(deletion.level);
                    points.as_slice().iter().map(key).collect()
                }
                DeletionTarget::Keys(keys) => keys.clone(),
                DeletionTarget::Region(region) => view.voxels_in(region, deletion.level),
                DeletionTarget::NotSeenSince(_) => unreachable!("nobody deletes so here"),
            };
            let voxels = view.descendants_of(keys, deletion.level);
            drop(view);
            map.committer().remove(&voxels).removed
        }
        Event::Queried { .. } => 0,
    }
}

fn assert_answered(map: &MultiResolutionMap, revision: u64, event: &Event) {
    match event {
        Event::Queried { points, level, occupied } => {
            let (view, quantize) = (map.view(), map.lattice().from_map());
            for (i, (&point, &occupied)) in points.iter().zip(occupied).enumerate() {
                let voxel = quantize.key(point).unwrap().ancestor(*level);
                assert_eq!(view.contains(voxel, *level), occupied, "point {i} at revision {revision}");
            }
        }
        Event::Deleted { removed, .. } => assert_eq!(*removed, 0),
        Event::Inserted { .. } => unreachable!("an insertion makes a revision"),
    }
}

/// Replays all changes in the order of revisions, and checks each answer at the revision that it reported.
fn assert_serial(history: History) -> MultiResolutionMap {
    let mut by_revision: BTreeMap<u64, (Vec<Event>, Vec<Event>)> = BTreeMap::new();
    for (revision, event) in history {
        let (changes, others) = by_revision.entry(revision).or_default();
        let changed =
            matches!(event, Event::Inserted { .. }) || matches!(event, Event::Deleted { removed: 1.., .. });
        if changed { changes.push(event) } else { others.push(event) }
    }
    let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, LEVELS)).unwrap();
    let mut queries = 0;
    for (revision, (changes, others)) in by_revision {
        if revision > 0 {
            assert_eq!(changes.len(), 1, "revision {revision} was acknowledged to one client");
            assert_eq!(map.revision() + 1, revision, "every revision was acknowledged");
            let changed = replay(&map, &changes[0]);
            match changes[0] {
                Event::Inserted { new_voxels, .. } => {
                    assert_eq!(changed, new_voxels, "at revision {revision}")
                }
                Event::Deleted { removed, .. } => assert_eq!(changed, removed, "at revision {revision}"),
                Event::Queried { .. } => {}
            }
        }
        queries += others.len();
        others.iter().for_each(|event| assert_answered(&map, revision, event));
    }
    println!("{} changes replayed, {queries} answers checked", map.revision());
    map
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_eight_clients_were_told_is_a_serial_history() {
    let daemon = Daemon::start().await;
    let url = format!("http://{}", daemon.grpc);
    daemon.make_map(MAP).await;
    let end = Instant::now() + Duration::from_secs(seconds());
    let watchdog = Watchdog::begin(std::process::id(), STILL_MAX);
    let mut clients = tokio::task::JoinSet::new();
    for seed in 0..4 {
        clients.spawn(grpc_client(url.clone(), seed, end, watchdog.heart()));
        clients.spawn(http_client(daemon.url(""), 100 + seed, end, watchdog.heart()));
    }
    let history = clients.join_all().await.into_iter().flatten().collect();
    drop(watchdog);

    let replayed = assert_serial(history);
    let expected: VoxelSet = replayed.view().voxels();
    let client = Client::connect(&url).await.unwrap();
    let listing = client.list_voxels(&MapName::new(MAP).unwrap(), ListingRequest::default()).await.unwrap();
    assert_eq!(listing.version.revision, replayed.revision());
    assert_eq!(listing.keys.into_iter().collect::<VoxelSet>(), expected);
    daemon.stop().await;
}
