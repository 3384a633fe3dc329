//! A search under supervision: looks at its stop signal, far returns, endless boxes, memory.

use std::cell::{Cell, RefCell};

use super::*;
use crate::align::{AlignmentSettings, Verdict};
use crate::geometry::{Point, Pose};
use crate::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use crate::util::StopSignal;
use crate::voxel::sample_bytes_max;

/// Cells of a grid or points that are visited between two looks, at most.
const WORK_PER_STOP_CHECK: u64 = 8 << 20;

fn record(points: &[Point], map: &MultiResolutionMap) -> ScanRecord {
    let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
    ScanRecord::of_points(pose, points, map.lattice())
}

/// Two walls and a floor below the sensor that meet in a corner, a point at the center of each voxel.
fn corner() -> Vec<Point> {
    let at = |i: i32| i as f32 * 0.05 + 0.025;
    let spans = move |n: i32| (0..n).flat_map(move |i| (0..n).map(move |j| (at(i), at(j))));
    let walls = spans(60).flat_map(|(a, b)| {
        [[2.025, a - 1.0, b - 0.5], [a - 1.0, 2.025, b - 0.5], [a - 1.0, b - 1.0, -0.475]]
    });
    walls.map(Point::from).collect()
}

fn map_of(points: &[Point]) -> MultiResolutionMap {
    let map = MultiResolutionMap::new(MapSettings::new(0.05, 4)).unwrap();
    map.committer().insert_scan(record(points, &map));
    map
}

fn downward() -> LocalizationQuery {
    let gravity = Gravity::new(MAP_DOWN, MAP_DOWN).ok();
    LocalizationQuery { gravity, candidates: 2, ..LocalizationQuery::default() }
}

/// What a search under supervision said, and what its supervisor saw.
struct Seen {
    found: Result<Localization, LocalizationError>,
    looks: u64,
    /// Cells of poses between two looks, at most.
    cells_per_look: u64,
    reserved: usize,
}

/// Searches until so many looks were taken at the signal, with memory for so many bytes.
fn search(
    map: &MultiResolutionMap,
    points: &[Point],
    query: &LocalizationQuery,
    looks_max: u64,
    bytes_max: usize,
) -> Seen {
    let (looks, reserved) = (Cell::new(0), Cell::new(0));
    // The cells at the last look are not known to the closure: progress tells them a look later at most.
    let cells = RefCell::new((0, 0));
    let is_over = || looks.replace(looks.get() + 1) >= looks_max;
    let last_looks = Cell::new(0);
    let supervision = &mut Supervision {
        stop: StopSignal::when(&is_over),
        search_stop: StopSignal::NEVER,
        progress: &mut |progress| {
            let (last, most) = *cells.borrow();
            let between = looks.get() - last_looks.replace(looks.get()) + 1;
            *cells.borrow_mut() = (progress.cells, most.max((progress.cells - last) / between));
        },
        reserve: &mut |bytes| {
            let more = reserved.get() + bytes <= bytes_max;
            reserved.set(reserved.get() + bytes);
            more
        },
    };
    let settings = (LocalizationSettings::default(), AlignmentSettings::default());
    let found = localize_supervised(map, points, query, &settings.0, &settings.1, supervision);
    let cells_per_look = cells.borrow().1;
    Seen { found, looks: looks.get(), cells_per_look, reserved: reserved.get() }
}

#[test]
fn an_endless_box_and_a_far_return_are_searched_as_far_as_the_scan_sees() {
    let map = map_of(&corner());
    let search_box = SearchBox::new([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]).ok();
    for far in [150.0, 100_000.0, 1e30] {
        let mut points = corner();
        points.push(Point::new(far, 0.0, 0.0));
        let query = LocalizationQuery { search_box, ..downward() };
        let seen = search(&map, &points, &query, u64::MAX, usize::MAX);
        let found = seen.found.unwrap();
        assert!(!found.cut_short, "{far}: {}", found.reason);
        assert!(found.cells < 5_000_000, "{far}: {} cells", found.cells);
        let at = found.candidates[0].map_from_sensor;
        assert!(at.translation.vector.norm() < 0.05, "{far}: {at:?}");
        assert!(seen.cells_per_look <= 8 * 64, "{far}: {} cells between two looks", seen.cells_per_look);
    }
}

#[test]
fn a_search_that_is_stopped_at_any_look_ends_there_and_accepts_nothing() {
    let map = map_of(&corner());
    let all = search(&map, &corner(), &downward(), u64::MAX, usize::MAX);
    assert_eq!(all.found.as_ref().unwrap().verdict, Verdict::Accepted, "{:?}", all.found);
    // Without gravity the surfaces of the map and of the scan are looked at as well.
    for query in [downward(), LocalizationQuery { gravity: None, ..downward() }] {
        for looks_max in (0..40).chain((1..10).map(|tenth| all.looks * tenth / 10)) {
            let seen = search(&map, &corner(), &query, looks_max, usize::MAX);
            let found = seen.found.unwrap();
            assert!(found.cut_short && !found.exhaustive && found.verdict != Verdict::Accepted);
            // Whatever was under way asks once each on its way out.
            assert!(seen.looks <= looks_max + 60, "{} looks after {looks_max}", seen.looks);
        }
    }
}

#[test]
fn a_larger_map_and_a_larger_scan_are_looked_at_as_much_oftener() {
    let searched = |repeats: usize, apart_m: f32| {
        let stray = (0..repeats).flat_map(|i| {
            corner().into_iter().map(move |point| {
                let [x, y, z] = point.xyz();
                Point::new(x + i as f32 * apart_m, y, z)
            })
        });
        let map = map_of(&stray.collect::<Vec<_>>());
        let points = corner().repeat(repeats);
        // Up to the search: what was built and looked at so far is points, blocks and cells of grids.
        let query = LocalizationQuery { gravity: None, ..downward() };
        let settings = LocalizationSettings { cells_waiting_max: 8, ..LocalizationSettings::default() };
        let looks = Cell::new(0u64);
        let searching = Cell::new(false);
        let is_over = || {
            looks.set(looks.get() + 1);
            searching.get()
        };
        let reserved = Cell::new(0);
        let supervision = &mut Supervision {
            stop: StopSignal::when(&is_over),
            search_stop: StopSignal::NEVER,
            progress: &mut |_| searching.set(true),
            reserve: &mut |bytes| {
                reserved.set(reserved.get() + bytes);
                true
            },
        };
        localize_supervised(&map, &points, &query, &settings, &AlignmentSettings::default(), supervision)
            .unwrap();
        // Each byte of a grid is visited in each of eight rounds five times, and a point in each of 16 trials.
        (40 * reserved.get() as u64 + 16 * points.len() as u64) / looks.get()
    };
    for (repeats, apart_m) in [(1, 5.0), (4, 20.0), (8, 20.0)] {
        let work = searched(repeats, apart_m);
        assert!(work <= WORK_PER_STOP_CHECK, "{work} units between two looks, {repeats} times the scan");
    }
}

#[test]
fn memory_is_asked_for_before_it_is_taken_and_what_is_refused_ends_the_search() {
    let map = map_of(&corner());
    let all = search(&map, &corner(), &downward(), u64::MAX, usize::MAX);
    assert!(all.found.is_ok());
    let view = map.view();
    let blocks = size_of_val(view.voxels().blocks());
    drop(view);
    let points = size_of_val(&*corner());
    assert!(all.reserved > blocks + points, "{} bytes", all.reserved);
    for bytes_max in [0, points, points + sample_bytes_max(corner().len()) + blocks] {
        let refused = search(&map, &corner(), &downward(), u64::MAX, bytes_max).found.unwrap_err();
        assert!(matches!(refused, LocalizationError::NoMemory { .. }), "{refused}");
    }
}
