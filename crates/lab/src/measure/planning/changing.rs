//! Planners' questions about a map that changes ten times a second.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::arms::meets;
use crate::workload::bodies::arm::{self, Hand};
use crate::workload::bodies::place::Surface;
use crate::workload::{Order, Queries, Workload, add};
use mrol_map::map::{MapSettings, MultiResolutionMap};
use mrol_map::planning::Planner;
use mrol_map::voxel::VoxelSet;

/// What a map that changes costs a planner, and what a planner costs the map.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changing {
    /// Nanoseconds a pose while nothing changes.
    pub steady_ns: f64,
    /// Nanoseconds a pose while a scan is inserted ten times a second, what is made anew included.
    pub between_ns: f64,
    /// The first question after each insertion, about 100 poses anywhere; milliseconds, ascending.
    pub first_checks_ms: Vec<f64>,
    /// Insertions of a scan into a map with a planner that is asked in between, and into one without; milliseconds,
    /// ascending.
    pub with_planner_ms: Vec<f64>,
    /// The same without a planner.
    pub without_planner_ms: Vec<f64>,
    /// Voxels that a scan adds, on average.
    pub changed_voxels: f64,
}

/// Why it cannot be measured.
type Refused = Box<dyn std::error::Error + Send + Sync>;

/// Points of a scan.
const SCAN_POINTS: usize = 20_000;
/// Poses of the first question after an insertion.
const FIRST_POSES: usize = 100;
/// Poses of the other ones.
const POSES: usize = 5000;
/// From one insertion to the next.
const PERIOD: Duration = Duration::from_millis(100);

/// Inserts `scans` scans of 20,000 points into the map of a workload, ten a second, while an arm's poses are asked
/// about all the time, by one thread.
///
/// # Errors
/// When a setting is out of range, or the map's voxels are too small for the arm.
pub fn between_insertions(
    workload: Workload,
    settings: MapSettings,
    scans: usize,
    seed: u64,
) -> Result<Changing, Refused> {
    let [map, other] = [Arc::new(workload.map(settings)?), Arc::new(workload.map(settings)?)];
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (arm, surface) = (arm::body(Hand::Moves)?, Surface::of(&map, &mut random));
    let numbers = arm::configurations(Hand::Moves, &surface, POSES, &mut random);
    let planner = Planner::new(Arc::clone(&map));
    meets(&planner, &arm, &numbers)?;
    let mut measured = Changing { steady_ns: steady_ns(&planner, &arm, &numbers)?, ..Changing::default() };
    let (before, mut asked, mut took) = (map.voxels(0), 0, Duration::ZERO);
    let scans_of = workload.queries(Order::Scan, scans * SCAN_POINTS, seed);
    for scan in sets(&scans_of, &map) {
        measured.without_planner_ms.push(inserting_ms(&other, scan.clone()));
        measured.with_planner_ms.push(inserting_ms(&map, scan));
        let start = Instant::now();
        let few = arm::configurations(Hand::Moves, &surface, FIRST_POSES, &mut random);
        let first = Instant::now();
        meets(&planner, &arm, &few)?;
        measured.first_checks_ms.push(first.elapsed().as_secs_f64() * 1e3);
        while start.elapsed() < PERIOD {
            let question = Instant::now();
            meets(&planner, &arm, &numbers)?;
            took += question.elapsed();
            asked += POSES;
        }
        took += Duration::from_secs_f64(measured.first_checks_ms.last().copied().unwrap_or(0.0) / 1e3);
        asked += FIRST_POSES;
    }
    measured.between_ns = took.as_nanos() as f64 / asked.max(1) as f64;
    measured.changed_voxels = (map.voxels(0) - before) as f64 / scans.max(1) as f64;
    for times in
        [&mut measured.first_checks_ms, &mut measured.with_planner_ms, &mut measured.without_planner_ms]
    {
        times.sort_unstable_by(f64::total_cmp);
    }
    Ok(measured)
}

fn steady_ns(planner: &Planner, arm: &mrol_map::planning::Body, numbers: &[f32]) -> Result<f64, Refused> {
    let mut runs = crate::measure::stopwatch::Runs::default();
    for _ in 0..11 {
        runs.time(POSES, || meets(planner, arm, numbers))?;
    }
    Ok(runs.median())
}

/// The scans as sets of voxels.
fn sets(scans: &Queries, map: &MultiResolutionMap) -> impl Iterator<Item = VoxelSet> {
    let quantize = map.lattice().from_points(&scans.map_from_points);
    scans.points.chunks(SCAN_POINTS).map(move |scan| VoxelSet::of_points(scan, &quantize).0)
}

fn inserting_ms(map: &MultiResolutionMap, voxels: VoxelSet) -> f64 {
    let start = Instant::now();
    add(map, voxels);
    start.elapsed().as_secs_f64() * 1e3
}
