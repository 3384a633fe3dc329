//! What scans leave as seen through: of robots that see parts of themselves, and of sensors that move during a scan.

use std::ops::Range;

use mrol::geometry::{Point, Pose};
use mrol::map::{MapSettings, MultiResolutionMap, RobotName};
use mrol::mapping::{FilteredPoints, Guess, MappingSettings, RayEnds, Scan, ScanMapper, Sightings};
use mrol::scan::PointFilter;
use mrol::util::StopSignal;

const SWEEP_S: f64 = 0.1;
/// Columns of rays of a sweep, and how far around they go.
const COLUMNS: i32 = 600;
const AROUND_DEG: f64 = 60.0;

/// Maps a scan at its guess; what did not fit anything would be refused.
fn map_at(map: &MultiResolutionMap, at: &Pose, scan: Scan<'_>) {
    let scan = Scan { guess: Guess::Pose(*at), at_guess: true, ..scan };
    let sightings = Sightings::default();
    let mapper = ScanMapper::new(map, &sightings, MappingSettings::default());
    assert!(mapper.map_scan(&scan, StopSignal::NEVER).unwrap().is_inserted());
}

fn new_map() -> MultiResolutionMap {
    MultiResolutionMap::new(MapSettings::new(0.05, 4)).unwrap()
}

/// Where the sensor was, along the y axis, when it took the column, and the column's azimuth and time.
fn column(index: i32, moved_m: f64) -> (f64, f64, f64) {
    let share = f64::from(index) / f64::from(COLUMNS);
    (-moved_m * (1.0 - share), (share - 0.5) * AROUND_DEG.to_radians(), -SWEEP_S * (1.0 - share))
}

/// A wall at x = 8 m, and a plate before it at 3 m between two places on the y axis; seen by a sensor that comes along
/// the y axis to the map's origin. Points in the sensor frame of their times, these times, and the points in the map.
fn swept(moved_m: f64, plate_m: &Range<f64>) -> (Vec<Point>, Vec<f32>, Vec<Point>) {
    let ray = |(index, row): (i32, i32)| {
        let (y, azimuth, time_s) = column(index, moved_m);
        let is_at_plate = plate_m.contains(&(y + 3.0 * azimuth.tan()));
        let x = if is_at_plate { 3.0 } else { 8.0 };
        let [across, up] = [x * azimuth.tan(), x * f64::from(row) * 0.003];
        let point = |y: f64| Point::new(x as f32, (y + across) as f32, up as f32);
        (point(0.0), time_s as f32, point(y))
    };
    (0..=COLUMNS).flat_map(|index| (-80..=80).map(move |row| (index, row))).map(ray).collect()
}

#[test]
fn behind_what_hid_it_from_a_moving_sensor_nothing_is_free() {
    let (moved_m, plate_m) = (0.4, -0.2..0.2);
    let (points, times_s, in_map) = swept(moved_m, &plate_m);
    let robot = RobotName::new("r").unwrap();
    let patch: Vec<Point> =
        (0..400).map(|i| Point::new(-4.0, (i % 20) as f32 * 0.05, (i / 20) as f32 * 0.05)).collect();
    let free = |points: &[Point], times_s: Option<&[f32]>| {
        let map = new_map();
        let before = Scan { timestamp_ns: Some(0), ..Scan::new(&robot, &patch) };
        map_at(&map, &Pose::translation(0.0, -moved_m, 0.0), before);
        let scan = Scan { timestamp_ns: Some(100_000_000), times_s, ..Scan::new(&robot, points) };
        map_at(&map, &Pose::identity(), scan);
        let viewpoints = map.viewpoints();
        assert_eq!(viewpoints.len(), 2);
        let places = (0..45)
            .flat_map(|i| (0..=120).map(move |j| (3.15 + f64::from(i) * 0.1, f64::from(j) * 0.05 - 3.0)));
        let seen: Vec<(f64, f64)> = places.filter(|&(x, y)| viewpoints.is_free([x, y, 0.0])).collect();
        // The ray that ran through a place ended at the plate.
        let is_hidden = |&&(x, y): &&(f64, f64)| {
            let off = |index: &i32| {
                let (from_y, azimuth, _) = column(*index, moved_m);
                (from_y + x * azimuth.tan() - y).abs()
            };
            let nearest = (0..=COLUMNS).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            let (from_y, azimuth, _) = column(nearest, moved_m);
            plate_m.contains(&(from_y + 3.0 * azimuth.tan()))
        };
        (seen.len(), seen.iter().filter(is_hidden).count())
    };
    let (seen, hidden) = free(&points, Some(&times_s));
    assert!(seen > 300 && hidden == 0, "{seen} places are free, {hidden} of them were hidden");
    // What the trial shows of the same points as if all rays had been taken at the end.
    let (_, hidden) = free(&in_map, None);
    assert!(hidden > 10, "{hidden}");
}

#[test]
fn behind_the_robots_own_parts_nothing_is_free() {
    // A strut of 4 cm at 0.5 m, before a wall.
    let range_m = |azimuth: f64| if azimuth.tan().abs() < 0.04 { 0.5 } else { 8.0 };
    let rays =
        (-300..=300).flat_map(|i| (-60..=60).map(move |row| (f64::from(i) * 0.002, f64::from(row) * 0.004)));
    let points: Vec<Point> = rays
        .map(|(azimuth, up)| Point::from([1.0, azimuth.tan(), up].map(|c| (c * range_m(azimuth)) as f32)))
        .collect();
    let robot = RobotName::new("r").unwrap();
    let body = PointFilter { body_m: Some(([0.4, -0.1, -1.0], [0.6, 0.1, 1.0])), ..PointFilter::default() };
    let near = PointFilter { range_min_m: Some(0.7), ..PointFilter::default() };
    for filter in [body, near] {
        let filtered =
            FilteredPoints::of(RayEnds { points: &points, times_s: None }, filter, &robot, false).unwrap();
        assert!(filtered.skipped.total() > 1000);
        let RayEnds { points, .. } = filtered.surroundings();
        let of_robot = filtered.of_robot();
        let map = new_map();
        map_at(&map, &Pose::identity(), Scan { of_robot, ..Scan::new(&robot, points) });
        let viewpoints = map.viewpoints();
        for i in 0..140 {
            let x = 0.7 + f64::from(i) * 0.05;
            for aside in [-0.03, 0.0, 0.03] {
                assert!(!viewpoints.is_free([x, aside * x, 0.0]), "{aside} at {x} m");
            }
        }
        assert!(viewpoints.is_free([0.4, 0.0, 0.0]) && viewpoints.is_free([5.0, 1.0, 0.1]));
    }
}
