//! What a trajectory takes in the long run: eight robots drive round after round through the same hall, ten scans a
//! second each, and the memory that the second half of their scans adds is that of one pose a minute and robot.
//!
//! `MROL_GROWTH_SCANS=1000000` sets the number of scans; without, 64,000.

use mrol::geometry::{Point, Pose};
use mrol::map::{
    MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord, SessionName, TrajectorySpacing,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const ROBOTS: u64 = 8;
/// Revisions that undo would reach, and how often thinning is done.
const REACH: u64 = 4000;
const THINNED_EVERY: u64 = 1000;
/// What is stated of a pose that is kept, with all its indices.
const POSE_BYTES: usize = 400;

/// Where a robot is that drives round a rectangle of 12 by 8 m at 1 m/s, within 2 cm of its path.
fn place(robot: u64, step: u64, random: &mut ChaCha8Rng) -> Pose {
    let s = (step as f64 * 0.1 + robot as f64 * 5.0) % 40.0;
    let (x, y, yaw) = match s {
        s if s < 12.0 => (s, 0.0, 0.0),
        s if s < 20.0 => (12.0, s - 12.0, 90.0),
        s if s < 32.0 => (32.0 - s, 8.0, 180.0),
        s => (0.0, 40.0 - s, 270.0),
    };
    let mut jitter = || random.random_range(-0.02..0.02);
    let (x, y) = (x + jitter() + robot as f64 * 0.13, y + jitter());
    Pose::new([x, y, 0.3].into(), [0.0, 0.0, f64::to_radians(yaw + jitter() * 50.0)].into())
}

#[test]
fn the_second_half_of_the_scans_adds_a_pose_a_minute_and_robot() {
    let scans: u64 = std::env::var("MROL_GROWTH_SCANS").map_or(64_000, |scans| scans.parse().unwrap());
    let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).unwrap();
    let names: Vec<_> = (0..ROBOTS).map(|n| RobotName::new(&format!("r{n}")).unwrap()).collect();
    let points: Vec<_> = (0..8).map(|i| Point::new(2.0, i as f32 * 0.1, 0.5)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut half = 0;
    for scan in 0..scans {
        let (robot, step) = (scan % ROBOTS, scan / ROBOTS);
        let pose = MappedScan {
            scan_id: Some(step),
            timestamp_ns: Some(step as i64 * 100_000_000),
            level_overlaps: vec![0.9; 4],
            ..MappedScan::new(names[robot as usize].clone(), place(robot, step, &mut random))
        };
        map.committer().insert_scan(ScanRecord::of_points(pose, &points, map.lattice()));
        // As far behind at half as in the end.
        let (is_half, is_end) = (scan == scans / 2, scan + 1 == scans);
        if scan % THINNED_EVERY == 0 || is_half || is_end {
            map.committer().thin((scan + 1).saturating_sub(REACH), &TrajectorySpacing::default());
        }
        if is_half {
            half = map.trajectory().memory_bytes();
        }
    }
    let trajectory = map.trajectory();
    let (all, kept) = (trajectory.memory_bytes(), trajectory.len());
    let minutes = (scans / 2 / 600) as usize;
    // Those that come by noise into a cell that nobody was in: few, and ever fewer.
    let stated = (minutes + minutes / 4 + 100) * POSE_BYTES;
    println!("{scans} scans: {kept} poses, {all} bytes; the second half added {}", all.saturating_sub(half));
    let thick = scans as usize / 2 * POSE_BYTES / 2;
    assert!(stated < thick / 4, "what is stated says nothing: {stated} of {thick}");
    assert!(all <= half + stated, "{half} bytes at half, {all} in the end, {stated} are stated");
    assert!(names.iter().all(|robot| {
        (0..scans / ROBOTS).all(|id| trajectory.known(robot, &SessionName::default(), id).is_some())
    }));
}
