//! Questions of which a single part is large: they look at the stop signal in proportion to their work, and ask for no
//! more of the field at once than there is room for.

use std::cell::Cell;
use std::sync::Arc;

use crate::geometry::{Point, Pose};
use crate::map::{
    MapContents, MapSettings, MappedScan, MultiResolutionMap, Region, RobotName, ScanRecord, ViewpointRecord,
};
use crate::planning::check::UNMADE_MAX;
use crate::planning::*;
use crate::util::StopSignal;
use crate::visibility::{IMAGE_BYTES_MAX, RangeImage, Sweep};
use crate::voxel::{VoxelKey, VoxelSet};

const EVERYTHING: [f64; 3] = [1000.0; 3];
static ALL_VOXELS: Surroundings = Surroundings::ALL_VOXELS;

/// A floor of 100 x 100 voxels of 0.1 m.
fn floor() -> Planner {
    let voxels = (0..10_000).filter_map(|i| VoxelKey::new([i % 100, i / 100, 0]));
    let contents = MapContents::at(1, voxels.collect());
    Planner::new(Arc::new(MultiResolutionMap::restore(MapSettings::new(0.1, 4), contents).unwrap()))
}

/// A body of points in a row of 1 m, side by side.
fn row(points: usize) -> Body {
    let points = (0..points).map(|i| Point::new(i as f32 / points as f32, 0.0, 0.0)).collect();
    Body::new(vec![Link { points, ..Link::default() }]).unwrap()
}

fn ball(radius_m: f32) -> Body {
    let spheres = vec![Sphere { center_m: [0.0; 3], radius_m }];
    Body::new(vec![Link { spheres, ..Link::default() }]).unwrap()
}

/// The numbers of poses at these places.
fn at(places: &[[f32; 3]]) -> Vec<f32> {
    places.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0.0, 0.0, 0.0, 1.0]).collect()
}

/// Asks until the question is answered, then again with a signal that stops it at each of some looks: how often it
/// looked.
fn looks<A: std::fmt::Debug>(ask: impl Fn(StopSignal<'_>) -> Option<A>) -> usize {
    let looks = Cell::new(0);
    let never = || looks.replace(looks.get() + 1) == usize::MAX;
    assert!(ask(StopSignal::when(&never)).is_some());
    let all = looks.get();
    for most in [0, 1, 2, all / 2] {
        looks.set(0);
        let stops = || looks.replace(looks.get() + 1) >= most;
        assert!(ask(StopSignal::when(&stops)).is_none(), "it was told to stop at look {most} of {all}");
        assert!(looks.get() <= most + 3, "{} looks of which {most} let it go on", looks.get());
    }
    all
}

fn motion<'a>(body: &'a Body, numbers: &'a [f32], step_m: f32, clear_m: Option<f32>) -> MotionQuestion<'a> {
    MotionQuestion {
        body,
        configurations: Configurations::new(numbers, 1).unwrap(),
        lengths: &[2],
        step_m: Some(step_m),
        clearance_max_m: clear_m,
        level: 0,
        surroundings: &ALL_VOXELS,
    }
}

#[test]
fn one_motion_of_many_steps_and_points_looks_at_the_signal_in_proportion_to_them() {
    let (planner, body) = (floor(), row(4000));
    // So low that no step is skipped.
    let numbers = at(&[[1.0, 5.0, 0.11], [2.0, 5.0, 0.11]]);
    let steps = |step_m: f32| {
        looks(|stop| planner.view().check_motions(&motion(&body, &numbers, step_m, None), stop).unwrap())
    };
    let (few, many) = (steps(0.004), steps(0.001));
    assert!(few >= 8 && many >= 2 * few, "{few} and {many} looks");
}

#[test]
fn the_clearance_of_one_motion_looks_at_the_signal() {
    let (planner, body) = (floor(), ball(0.01));
    let numbers = at(&[[1.0, 5.0, 3.0], [2.0, 5.0, 3.0]]);
    let ask = |stop: StopSignal<'_>| {
        planner.view().check_motions(&motion(&body, &numbers, 0.001, Some(6.0)), stop).unwrap()
    };
    assert!(looks(ask) >= 8);
}

#[test]
fn one_sphere_that_ignores_what_it_meets_looks_at_the_signal() {
    let (planner, body) = (floor(), ball(20.0));
    let everything = Region::cuboid(EVERYTHING.map(|c| -c), EVERYTHING).unwrap();
    let surroundings = Surroundings { ignored: vec![everything], ..Surroundings::ALL_VOXELS };
    let numbers = at(&[[5.0, 5.0, 1.0]; 8]);
    let configurations = Configurations::new(&numbers, 1).unwrap();
    let question = PoseQuestion { body: &body, configurations, level: 0, surroundings: &surroundings };
    assert!(looks(|stop| planner.view().bodies_meet(&question, stop).unwrap()) >= 8);
    assert!(looks(|stop| planner.view().first_hits(&question, stop).unwrap()) >= 8);
}

#[test]
fn a_view_that_may_not_wait_answers_from_what_is_made_and_makes_nothing() {
    let (planner, body) = (floor(), ball(0.2));
    let numbers = at(&[[5.0, 5.0, 0.25], [5.0, 5.0, 0.35]]);
    let configurations = Configurations::new(&numbers, 1).unwrap();
    let question =
        PoseQuestion { body: &body, configurations, level: 0, surroundings: &Surroundings::ALL_VOXELS };
    let ask = |view: PlanningView<'_>| view.bodies_meet(&question, StopSignal::NEVER).unwrap();
    let at_once = || planner.try_view().map(ask);
    // What an answer did not wait for is made for the next one.
    let make_all = || (0..8).for_each(|_| assert_eq!(ask(planner.view()), Some(vec![0b01])));
    assert_eq!((at_once(), planner.field_bytes()), (Some(None), 0));
    make_all();
    assert_eq!(at_once(), Some(Some(vec![0b01])));
    planner.map().committer().remove(&VoxelKey::new([50, 50, 0]).into_iter().collect());
    assert_eq!(at_once(), None, "the fields are to be mended");
    make_all();
    assert_eq!(at_once(), Some(Some(vec![0b01])));
}

/// What a motion waits for was noted at every step again: gigabytes of it.
#[test]
fn a_motion_far_beyond_what_is_made_is_answered_in_rounds_of_so_much() {
    let voxels = (0..40_000).filter_map(|i| VoxelKey::new([i / 4 * 10, i % 4 * 20, 0]));
    let contents = MapContents::at(1, voxels.collect());
    let map = Arc::new(MultiResolutionMap::restore(MapSettings::new(0.1, 4), contents).unwrap());
    let (planner, body) = (Planner::new(map), row(64));
    // Above the floor, along it for 10 km: the field around it has more blocks than are made at once.
    let numbers = at(&[[0.0, 0.0, 0.35], [9_900.0, 0.0, 0.35]]);
    let question = motion(&body, &numbers, 0.2, None);
    let answer = planner.view().check_motions(&question, StopSignal::NEVER).unwrap().unwrap();
    assert!(answer[0].is_free(), "{answer:?}");
    let blocks = planner.field_bytes() / 512;
    assert!(blocks > 2 * UNMADE_MAX, "{blocks} blocks");
}

/// A map of voxels of 1 mm that nothing is in, and that a scan looked into 20 m far.
fn seen_from_afar() -> MultiResolutionMap {
    let map = MultiResolutionMap::new(MapSettings::new(0.001, 4)).unwrap();
    let points: Vec<Point> =
        (0..40_000).map(|i| Point::new(20.0, (i % 200) as f32 * 0.05, (i / 200) as f32 * 0.05)).collect();
    let image = RangeImage::of_points(&points, Sweep::standing(60.0), IMAGE_BYTES_MAX).unwrap();
    let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
    let viewpoint = Some(ViewpointRecord { image, displaced: Vec::new() });
    map.committer().insert_scan(ScanRecord { viewpoint, ..ScanRecord::of_voxels(pose, VoxelSet::default()) });
    map
}

#[test]
fn a_grid_of_what_was_seen_from_afar_ends_when_it_is_stopped_and_keeps_no_list_of_it() {
    let map = seen_from_afar();
    let mut view = map.view().with_viewpoints().into();
    // Some 10^11 blocks were looked into: a list of them is no answer.
    let area = GridArea::Rectangle { min_m: [0.0; 2], max_m: [20.0; 2] };
    let request = GridRequest {
        level: 0,
        area,
        band_m: [-20.0, 20.0],
        band_from: BandFrom::Map,
        cell_m: 0.1,
        tells_unknown: true,
        cells_max: 1 << 20,
    };
    let looks = Cell::new(0);
    let stops = || looks.replace(looks.get() + 1) >= 40;
    let _some = project_grid(&mut view, &request, StopSignal::when(&stops)).unwrap();
    assert!((40..=60).contains(&looks.get()), "{} looks of which 40 let it go on", looks.get());
}

#[test]
fn points_that_viewpoints_are_asked_of_look_at_the_signal_often() {
    let map = seen_from_afar();
    let view = map.view().with_viewpoints();
    let points: Vec<Point> = (0..4096).map(|i| Point::new(5.0, 0.001 * i as f32, 1.0)).collect();
    let looks = Cell::new(0);
    let never = || looks.replace(looks.get() + 1) == usize::MAX;
    assert!(classify_points(&view, &points, 0, StopSignal::when(&never)).unwrap().points_free() > 1000);
    assert!(looks.get() >= 4096 / 16, "{} looks", looks.get());
}
