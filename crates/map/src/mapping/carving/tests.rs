//! Carving against what stands in rooms of boxes, and against the rays of their scans, asked one by one.

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::geometry::{Point, Pose};
use crate::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use crate::mapping::MappingError;
use crate::util::StopSignal;
use crate::visibility::ScanRays;
use crate::voxel::{VoxelKey, VoxelSet};

const RESOLUTION_M: f64 = 0.1;
/// Smallest and largest corner of the room.
const ROOM_M: [[f64; 3]; 2] = [[0.0; 3], [5.0, 4.0, 2.5]];
/// Directions of a scan.
const RAYS: usize = 30_000;

/// Boxes in a room, by their smallest and largest corners.
type Boxes = Vec<[[f64; 3]; 2]>;

fn any_boxes(random: &mut ChaCha8Rng, count: usize) -> Boxes {
    let mut any = |(from, to): (f64, f64)| random.random_range(from..to);
    let any_box = |_| {
        let low = [any((0.0, 4.0)), any((0.0, 3.0)), 0.0];
        let size = [any((0.4, 1.0)), any((0.4, 1.0)), any((0.4, 2.0))];
        [low, std::array::from_fn(|axis| low[axis] + size[axis])]
    };
    (0..count).map(any_box).collect()
}

/// How far a ray from `origin` goes: to a box, or to the walls of the room.
fn range_m(boxes: &Boxes, origin: [f64; 3], direction: [f64; 3]) -> f64 {
    let interval = |[low, high]: [[f64; 3]; 2]| {
        let ends = (0..3).map(|axis| {
            let ends = [low[axis], high[axis]].map(|end| (end - origin[axis]) / direction[axis]);
            (ends[0].min(ends[1]), ends[0].max(ends[1]))
        });
        ends.fold((f64::NEG_INFINITY, f64::INFINITY), |(from, to), (a, b)| (from.max(a), to.min(b)))
    };
    let hits = boxes.iter().map(|b| interval(*b)).filter(|(from, to)| from <= to && *from > 0.0);
    hits.map(|(from, _)| from).fold(interval(ROOM_M).1, f64::min)
}

/// A place of a sensor that is in no box, with a turn.
fn any_pose(random: &mut ChaCha8Rng, boxes: &Boxes) -> Pose {
    loop {
        let at: [f64; 3] = std::array::from_fn(|axis| random.random_range(0.5..ROOM_M[1][axis] - 0.5));
        let is_within =
            |b: &[[f64; 3]; 2]| (0..3).all(|axis| (b[0][axis] - 0.4..=b[1][axis] + 0.4).contains(&at[axis]));
        if !boxes.iter().any(is_within) {
            return Pose::new(Vector3::from(at), Vector3::new(0.3, -0.2, random.random_range(-3.0..3.0)));
        }
    }
}

/// A scan all around, sensor frame, with noise in range.
fn scan(random: &mut ChaCha8Rng, boxes: &Boxes, pose: &Pose, noise_m: f64) -> Vec<Point> {
    let origin = pose.translation.vector.into();
    let ray = |i: usize| {
        let z = (i as f64 + 0.5) / RAYS as f64 * 2.0 - 1.0;
        let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
        let direction = Vector3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
        let range = range_m(boxes, origin, (pose.rotation * direction).into());
        Point::from(Point3::from(direction * (range + noise_m * random.random_range(-1.0..1.0))))
    };
    (0..RAYS).map(ray).collect()
}

fn record(map: &MultiResolutionMap, pose: &Pose, points: &[Point]) -> ScanRecord {
    let taken = MappedScan::new(RobotName::new("r").unwrap(), *pose);
    ScanRecord::of_points(taken, points, map.lattice())
}

/// What a scan carves of a map.
fn carved(map: &MultiResolutionMap, pose: &Pose, points: &[Point], settings: &CarvingSettings) -> VoxelSet {
    let record = record(map, pose, points);
    let scan = CarvingScan { rays: ScanRays::met(points), record: &record, moved_m: 0.0, sensor: None };
    scan.carve(map, settings, StopSignal::NEVER).unwrap().voxels
}

/// A map of a room as five scans show it.
fn map_of(random: &mut ChaCha8Rng, boxes: &Boxes) -> MultiResolutionMap {
    let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 4)).unwrap();
    for _ in 0..5 {
        let pose = any_pose(random, boxes);
        let points = scan(random, boxes, &pose, 0.01);
        map.committer().insert_scan(record(&map, &pose, &points));
    }
    map
}

/// How far the nearest of the points is whose rays pass within `radius_m` of `offset`.
fn nearest_end_m(points: &[Point], offset: &Vector3<f64>, radius_m: f64) -> Option<f64> {
    let ends = points.iter().map(|point| point.to_f64().coords).filter(|point| {
        let along = offset.dot(&point.normalize());
        along > 0.0 && offset.norm_squared() - along * along < radius_m * radius_m
    });
    ends.map(|point| point.norm()).reduce(f64::min)
}

/// Distance of the nearest point, in voxels along the axis in which it is farthest.
fn voxels_to_nearest(touched: &VoxelSet, voxel: VoxelKey) -> i32 {
    let [x, y, z] = voxel.index();
    let steps = |other: VoxelKey| {
        let [a, b, c] = other.index();
        (x - a).abs().max((y - b).abs()).max((z - c).abs())
    };
    touched.iter().map(steps).min().unwrap_or(i32::MAX)
}

#[test]
fn what_is_carved_was_seen_through_and_what_was_seen_through_widely_is_carved() {
    let settings = CarvingSettings::default();
    let radius_m = RESOLUTION_M * 3f64.sqrt() / 2.0;
    let (mut gone, mut missed) = (0, 0);
    for seed in 0..3 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let before = any_boxes(&mut random, 5);
        let after: Boxes = before[..3].to_vec();
        let map = map_of(&mut random, &before);
        let pose = any_pose(&mut random, &before);
        let points = scan(&mut random, &after, &pose, 0.01);
        let carved = carved(&map, &pose, &points, &settings);
        let touched = record(&map, &pose, &points).voxels;
        assert!(touched.is_disjoint(&carved));
        let occupied = map.view().voxels();
        assert!(carved.difference(&occupied).is_empty());
        for voxel in occupied.iter() {
            let center = Point3::from(map.lattice().center_m(voxel, 0));
            let offset = pose.inverse_transform_point(&center).coords;
            let beyond_m = offset.norm() + radius_m;
            if carved.contains(voxel) {
                gone += 1;
                assert!(voxels_to_nearest(&touched, voxel) > settings.margin_voxels as i32, "{voxel:?}");
                let nearest_m = nearest_end_m(&points, &offset, 0.9 * radius_m);
                assert!(
                    nearest_m.is_none_or(|end_m| end_m > beyond_m),
                    "{voxel:?}: {nearest_m:?}, {beyond_m}"
                );
                continue;
            }
            // All rays around it, and some of the image's pixels away, end far behind it.
            if voxel.index().iter().sum::<i32>() % 5 != 0 || offset.norm() < 4.1 * radius_m {
                continue;
            }
            let around_m = radius_m + 0.2 * offset.norm();
            let nearest_m = nearest_end_m(&points, &offset, around_m);
            if nearest_m.is_some_and(|end_m| end_m > beyond_m + 0.5)
                && voxels_to_nearest(&touched, voxel) >= 4
            {
                missed += 1;
            }
        }
    }
    assert!(gone > 200 && missed * 100 <= gone, "{gone} voxels were carved, {missed} were missed");
}

#[test]
fn what_stands_is_kept_from_wherever_it_is_seen() {
    let settings = CarvingSettings::default();
    for seed in 10..12 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let boxes = any_boxes(&mut random, 5);
        let map = map_of(&mut random, &boxes);
        let voxels = map.voxels(0);
        let mut lost = 0;
        for _ in 0..5 {
            let pose = any_pose(&mut random, &boxes);
            let points = scan(&mut random, &boxes, &pose, 0.01);
            lost += carved(&map, &pose, &points, &settings).len();
        }
        assert!(lost * 1000 <= voxels, "{lost} of {voxels} voxels were carved");
    }
}

#[test]
fn nothing_is_carved_beyond_the_range_or_by_a_scan_without_points() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let boxes = any_boxes(&mut random, 5);
    let map = map_of(&mut random, &boxes);
    let pose = any_pose(&mut random, &boxes);
    let points = scan(&mut random, &Vec::new(), &pose, 0.0);
    let far = carved(&map, &pose, &points, &CarvingSettings::default());
    let settings = CarvingSettings { range_max_m: 1.5, ..CarvingSettings::default() };
    let near = carved(&map, &pose, &points, &settings);
    let distance_m = |voxel| {
        let center = Point3::from(map.lattice().center_m(voxel, 0));
        pose.inverse_transform_point(&center).coords.norm()
    };
    assert!(far.iter().any(|voxel| distance_m(voxel) > 1.5));
    assert!(!near.is_empty() && near.iter().all(|voxel| distance_m(voxel) <= 1.5));
    assert!(carved(&map, &pose, &[], &settings).is_empty());
    assert!(carved(&map, &pose, &[Point::new(0.0, 0.0, 0.0)], &settings).is_empty());
}

#[test]
fn carving_ends_when_it_is_stopped() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let map = map_of(&mut random, &Vec::new());
    let pose = any_pose(&mut random, &Vec::new());
    let points = scan(&mut random, &Vec::new(), &pose, 0.0);
    let record = record(&map, &pose, &points);
    let scan = CarvingScan { rays: ScanRays::met(&points), record: &record, moved_m: 0.0, sensor: None };
    let gone = || true;
    let stopped = scan.carve(&map, &CarvingSettings::default(), StopSignal::when(&gone));
    assert_eq!(stopped, Err(MappingError::Stopped));
}

#[test]
fn a_sensor_that_moves_meanwhile_carves_no_more_than_one_that_stands() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let boxes = any_boxes(&mut random, 5);
    let map = map_of(&mut random, &boxes);
    let pose = any_pose(&mut random, &boxes);
    let points = scan(&mut random, &Vec::new(), &pose, 0.0);
    let record = record(&map, &pose, &points);
    let of = |moved_m| {
        let scan = CarvingScan { rays: ScanRays::met(&points), record: &record, moved_m, sensor: None };
        scan.carve(&map, &CarvingSettings::default(), StopSignal::NEVER).unwrap().voxels
    };
    let (still, moving) = (of(0.0), of(0.1));
    assert!(moving.difference(&still).is_empty() && moving.len() < still.len());
}

#[test]
fn what_came_between_is_not_carved() {
    let voxels =
        |x: std::ops::Range<i32>| -> VoxelSet { x.filter_map(|x| VoxelKey::new([x, 0, 0])).collect() };
    let mut carving = Carving { voxels: voxels(0..30), revision: 7 };
    assert_eq!(carving.clone().at(7), voxels(0..30));
    assert!(carving.clone().at(8).is_empty());
    carving.cut(&voxels(20..50));
    carving.cut(&voxels(100..120));
    assert_eq!(carving.at(7), voxels(0..20));
}

#[test]
fn numbers_out_of_range_are_named() {
    let usual = CarvingSettings::default();
    let message = |settings: CarvingSettings| settings.checked().unwrap_err().to_string();
    assert_eq!(usual.checked(), Ok(usual));
    let wide = message(CarvingSettings { margin_voxels: 9, ..usual });
    assert!(wide.contains("carve_margin_voxels must be 1 to 8, got 9"), "{wide}");
    assert!(message(CarvingSettings { margin_voxels: 0, ..usual }).contains("got 0"));
    for grazing_deg in [0.5, 81.0, f64::NAN] {
        let message = message(CarvingSettings { grazing_deg, ..usual });
        assert!(message.contains("carve_grazing_deg must lie in 1 to 80 degrees"), "{message}");
    }
    for range_max_m in [0.0, -1.0, 201.0, f64::NAN] {
        let message = message(CarvingSettings { range_max_m, ..usual });
        assert!(message.contains("carve_range_max_m") && message.contains("at most 200 m"), "{message}");
    }
}
