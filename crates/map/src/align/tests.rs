//! Alignments under a stop signal, and of scans with far returns.

use std::cell::Cell;

use overlap::LOOKUPS_PER_STOP_CHECK;

use super::*;
use crate::geometry::{Point, Pose};
use crate::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use crate::util::{Keyword, StopSignal};

/// `count` points on two walls and a floor.
fn corner(count: usize) -> Vec<Point> {
    let place = |i: usize| ((i * 7919 % 3001) as f32 * 1e-3, (i * 104_729 % 2999) as f32 * 1e-3);
    let point = |i: usize| {
        let (a, b) = place(i / 3);
        Point::from([[2.0, a - 1.0, b], [a - 1.0, 2.0, b], [a - 1.0, b - 1.0, -0.5]][i % 3])
    };
    (0..count).map(point).collect()
}

fn map() -> MultiResolutionMap {
    let map = MultiResolutionMap::new(MapSettings::new(0.05, 4)).unwrap();
    let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
    map.committer().insert_scan(ScanRecord::of_points(pose, &corner(60_000), map.lattice()));
    map
}

fn settings(method: Method) -> AlignmentSettings {
    AlignmentSettings { method, sub_voxel_iterations_max: 3, sub_voxel_halvings: 1, ..Default::default() }
}

#[test]
fn an_alignment_looks_at_the_signal_in_proportion_to_its_work() {
    let (map, guess) = (map(), Pose::translation(0.07, -0.06, 0.05));
    for &method in Method::ALL {
        for count in [3_000, 30_000, 300_000] {
            let looks = Cell::new(0u64);
            let count_look = || looks.replace(looks.get() + 1) == u64::MAX;
            let points = corner(count);
            let stop = StopSignal::when(&count_look);
            let found = align_until(&map, &points, &guess.into(), &settings(method), stop);
            let work = (found.lookups + 16 * points.len() as u64) / looks.get();
            assert!(work <= LOOKUPS_PER_STOP_CHECK as u64, "{method:?}, {count} points: {work} a look");
        }
    }
}

#[test]
fn judging_a_pose_looks_at_the_signal_in_proportion_to_its_work() {
    let map = map();
    for count in [3_000, 30_000, 1_200_000] {
        let looks = Cell::new(0u64);
        let count_look = || looks.replace(looks.get() + 1) == u64::MAX;
        let (points, stop) = (corner(count), StopSignal::when(&count_look));
        evaluate_at(&map, &points, &Pose::identity(), &settings(Method::Overlap), stop);
        let levels = u64::from(map.settings().levels);
        let work = levels * points.len() as u64 / looks.get();
        assert!(work <= LOOKUPS_PER_STOP_CHECK as u64, "{count} points: {work} look-ups a look");
    }
}

#[test]
fn an_alignment_that_is_stopped_at_any_look_ends_there() {
    let (map, guess) = (map(), Pose::translation(0.3, -0.25, 0.2));
    let points = corner(300_000);
    for &method in Method::ALL {
        for looks_max in [0, 1, 3, 10, 20, 30, 50, 100] {
            let looks = Cell::new(0u64);
            let is_over = || looks.replace(looks.get() + 1) >= looks_max;
            align_until(&map, &points, &guess.into(), &settings(method), StopSignal::when(&is_over));
            // Each level and stage asks once on its way out.
            assert!(looks.get() <= looks_max + 100, "{method:?}: {} looks after {looks_max}", looks.get());
        }
    }
}

#[test]
fn a_far_return_says_nothing_of_a_pose() {
    let (map, guess) = (map(), Pose::translation(0.07, -0.06, 0.05));
    let points = corner(30_000);
    let settings = AlignmentSettings::default();
    let usual = align(&map, &points, &guess, &settings);
    assert_eq!(usual.verdict, Verdict::Accepted, "{}", usual.reason);
    for far in [1e7, 1e30, f32::MAX] {
        let with_far = [points.clone(), vec![Point::new(far, -far, far)]].concat();
        let found = align(&map, &with_far, &guess, &settings);
        assert_eq!(found.verdict, Verdict::Accepted, "{far}: {}", found.reason);
        assert_eq!(found.map_from_sensor, usual.map_from_sensor, "{far}");
        assert_eq!((found.iterations, found.lookups), (usual.iterations, usual.lookups), "{far}");
    }
    let only_far = align(&map, &[Point::new(1e30, 0.0, 0.0)], &guess, &settings);
    assert_ne!(only_far.verdict, Verdict::Accepted);
}
