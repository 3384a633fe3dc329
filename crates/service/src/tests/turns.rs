//! How often long work of each kind lets others go first: counted, not timed.

use std::cell::Cell;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use uuid::Uuid;

use crate::commit::CommitThreads;
use crate::limits::{Limits, Marks};
use crate::maps::HostedMap;
use crate::question::{
    CheckAs, ClassifyQuestion, FrontierQuestion, GridQuestion, GridScope, MotionCheck, NearestQuestion,
    PoseCheck, Question, QuestionScope, QuestionTarget, RayQuestion, RaysToward, SphereCheck,
};
use crate::request::{BlockForm, BlockRequest, WatchForm};
use crate::resources::ResourceBudget;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{
    MapName, MapSettings, MappedScan, MultiResolutionMap, Region, RobotName, SHARDS, ScanRecord,
    ViewpointRecord,
};
use mrol_map::planning::{BandFrom, Body, GridArea, Link, MeasuredTo, Sphere, Surroundings, Unknown};
use mrol_map::util::{GiveWay, StopSignal};
use mrol_map::visibility::{IMAGE_BYTES_MAX, RangeImage, Sweep};
use mrol_map::voxel::VoxelSet;
use mrol_store::StoreSettings;

/// Whenever work gives way, a change is made, with the same voxels: whoever holds a lock of the map panics or hangs.
struct ChangedBetween<'a> {
    map: &'a MultiResolutionMap,
    turns: Cell<u64>,
}

impl GiveWay for ChangedBetween<'_> {
    fn is_due(&self) -> bool {
        true
    }

    fn give_way(&self) {
        self.map.committer().exchange(&VoxelSet::default(), &VoxelSet::default());
        self.turns.set(self.turns.get() + 1);
    }

    fn paused_for(&self) -> Duration {
        Duration::ZERO
    }
}

/// A wall that was seen from 2 m before it, at voxels of 5 cm.
fn seen_wall() -> MultiResolutionMap {
    let map = MultiResolutionMap::new(MapSettings::new(0.05, 4)).unwrap();
    let points: Vec<_> =
        (0..20_000).map(|i| Point::new((i % 200) as f32 * 0.025, 2.01, (i / 200) as f32 * 0.025)).collect();
    let image = RangeImage::of_points(&points, Sweep::standing(20.0), IMAGE_BYTES_MAX).unwrap();
    let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
    let viewpoint = Some(ViewpointRecord { image, displaced: Vec::new() });
    map.committer()
        .insert_scan(ScanRecord { viewpoint, ..ScanRecord::of_points(pose, &points, map.lattice()) });
    map
}

/// How often a question gives way. What it is answered is the same where it does not, and of the revision before it.
fn turns_of<Q: Question>(map: &Arc<MultiResolutionMap>, question: &Q) -> u64 {
    // How long it takes is not what is tested: an emulated processor takes long.
    let limits = Limits { question_time_max_s: 600.0, long_question_time_max_s: 600.0, ..Limits::default() };
    let planner = OnceLock::new();
    let questioned = QuestionTarget::new(map, &planner, limits.planning_field_bytes_max);
    let (alone, _) = question.answer_from(&questioned, &limits, StopSignal::NEVER).unwrap();
    let (turns, revision) = (ChangedBetween { map, turns: Cell::default() }, map.revision());
    let stop = StopSignal::NEVER.giving_way_by(&turns);
    let (answer, version) = question.answer_from(&questioned, &limits, stop).unwrap();
    assert_eq!(format!("{answer:?}"), format!("{alone:?}"), "{}", Q::OPERATION);
    let turns = turns.turns.get();
    // What gives way before it begins is of the revision after that.
    let is_before = (revision..=revision + 1).contains(&version.revision);
    assert!(is_before && map.revision() == revision + turns, "{}: {version:?}", Q::OPERATION);
    turns
}

fn poses(count: usize) -> Vec<f32> {
    (0..count).flat_map(|i| [i as f32 * 0.001, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0]).collect()
}

/// A body of a thousand spheres.
fn body() -> Arc<Body> {
    let sphere = |i: usize| Sphere { center_m: [0.0, i as f32 * 1e-4, 0.0], radius_m: 0.05 };
    Arc::new(Body::new(vec![Link { spheres: (0..1000).map(sphere).collect(), ..Link::default() }]).unwrap())
}

fn points(count: usize) -> Vec<Point> {
    (0..count).map(|i| Point::new((i % 200) as f32 * 0.02 + 0.01, 1.9, 1.0)).collect()
}

#[test]
fn every_kind_of_long_question_gives_way_between_its_parts_and_is_answered_the_same() {
    let map = Arc::new(seen_wall());
    let (asked, surroundings) = (QuestionScope::default(), Surroundings::default());
    let check = |answer| PoseCheck {
        asked,
        body: body(),
        configurations: poses(1000),
        surroundings: surroundings.clone(),
        answer,
    };
    let spheres = |answer| SphereCheck {
        asked,
        spheres: (0..100_000)
            .map(|i| Sphere { center_m: [i as f32 * 1e-5, 1.5, 1.0], radius_m: 0.1 })
            .collect(),
        sizes: vec![100; 1000],
        padding_m: 0.0,
        surroundings: surroundings.clone(),
        answer,
    };
    let motions = MotionCheck {
        asked,
        body: body(),
        configurations: poses(128),
        lengths: vec![2; 64],
        step_m: None,
        clearance_max_m: Some(0.2),
        surroundings: surroundings.clone(),
    };
    let rays = |count, unknown| RayQuestion {
        asked,
        origins: vec![Point::new(0.01, 0.01, 0.01)].into(),
        toward: RaysToward::Ends(points(count).into()),
        unknown,
    };
    let nearest =
        NearestQuestion { asked, points: points(5000).into(), radius_m: 0.3, to: MeasuredTo::Cubes };
    let frontiers = FrontierQuestion {
        asked,
        min_m: [0.0; 3],
        max_m: [4.0; 3],
        size_min: None,
        frontiers_max: None,
        standoff_m: None,
    };
    let grid = |area, tells_unknown| {
        let band_m = [0.0, 2.0];
        GridQuestion {
            asked,
            scope: GridScope { area, band_m, band_from: BandFrom::Map, cell_m: None, tells_unknown },
        }
    };
    let area = GridArea::Rectangle { min_m: [0.0; 2], max_m: [4.0; 2] };
    let classified = ClassifyQuestion { asked, points: points(300_000).into() };
    let shards = SHARDS as u64;
    let table: [(&str, u64, u64); 13] = [
        ("poses", turns_of(&map, &check(CheckAs::Colliding)), 3),
        ("what poses meet first", turns_of(&map, &check(CheckAs::FirstHit)), 3),
        ("clearances of poses", turns_of(&map, &check(CheckAs::Clearance { most_m: Some(0.2) })), 3),
        ("spheres", turns_of(&map, &spheres(CheckAs::Colliding)), 2),
        ("clearances of spheres", turns_of(&map, &spheres(CheckAs::Clearance { most_m: Some(0.2) })), 2),
        ("motions", turns_of(&map, &motions), 3),
        ("rays", turns_of(&map, &rays(10_000, Unknown::Free)), 2),
        ("rays in sight", turns_of(&map, &rays(500, Unknown::Occupied)), 3),
        ("nearest", turns_of(&map, &nearest), 3),
        // 12 x 12 x 12 blocks, 16 at a time.
        ("frontiers", turns_of(&map, &frontiers), 12 * 12 * 12 / 16),
        ("a grid of what is there", turns_of(&map, &grid(GridArea::Occupied, false)), 2 * shards),
        // And the stacks of blocks that the viewpoint may have looked into: 10 along x, and up to the wall along y.
        ("a grid with what is unknown", turns_of(&map, &grid(area, true)), shards + 10 * 6),
        ("classification", turns_of(&map, &classified), 2),
    ];
    for (kind, turns, least) in table {
        assert!(turns >= least, "{kind}: {turns} times, {least} expected");
    }
}

#[test]
fn blocks_and_whole_states_give_way_and_are_of_one_revision() {
    let threads = CommitThreads::start().unwrap();
    let name = MapName::new("a").unwrap();
    let map = HostedMap::new(&threads, name, Uuid::nil(), seen_wall(), None, &StoreSettings::default());
    let (budget, limits) = (ResourceBudget::new(None, Marks::default()), Limits::default());
    let region = Region::cuboid([0.0; 3], [2.0; 3]).unwrap();
    let block = |form| BlockRequest { level: 0, form };
    let block = |form, stop: StopSignal<'_>| {
        let made = block(form).answer_in(&map.map, map.uuid, &limits, |_| Ok(()), stop).unwrap();
        (made.version.revision, format!("{:?}", made.voxels))
    };
    let state = |form, stop: StopSignal<'_>| {
        let made = map.whole_state(form, &budget, stop).unwrap();
        (made.version.revision, format!("{:?}", made.voxels))
    };
    type Made<'a> = &'a dyn Fn(StopSignal<'_>) -> (u64, String);
    let table: [(&str, Made<'_>, u64); 4] = [
        ("a sparse block", &|stop| block(BlockForm::Sparse { region: Some(region) }, stop), 1),
        // Each layer along z, with those around the box.
        ("a dense block", &|stop| block(BlockForm::Dense { region, cap_m: Some(0.2) }, stop), 40),
        ("a whole state", &|stop| state(WatchForm::Changes, stop), 1),
        ("a whole state of a level", &|stop| state(WatchForm::Deltas { level: 2 }, stop), 1),
    ];
    for (kind, made, least) in table {
        let (revision, alone) = made(StopSignal::NEVER);
        let turns = ChangedBetween { map: &map.map, turns: Cell::default() };
        let told = made(StopSignal::NEVER.giving_way_by(&turns));
        assert_eq!(told, (revision, alone), "{kind}");
        assert!(turns.turns.get() >= least, "{kind}: {} times", turns.turns.get());
    }
}
