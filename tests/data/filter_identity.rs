//! With an ample filter the poses are those of the exact set, bit for bit (paper IV-B, IV-C).
//!
//! "Ample" is a number: the false positives to expect over the whole run, every look-up counted as one of an
//! absent voxel, stay below one.

use mrol::align::{AlignmentSettings, Method, MultiStartSettings, align};
use mrol::bloom::FilterSettings;
use mrol::geometry::{Point, Pose, pose_difference};
use mrol::map::{Lookup, MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol_simulate::{Scene, tours};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::support::shared_scans;

/// Sixty-four words of plane a voxel: for identity, not for use.
const AMPLE: FilterSettings = FilterSettings { hashes: 10, bits_per_key: 4096.0 };
/// The paper's filter that is too small has a tenth of the counters.
const SMALL: FilterSettings = FilterSettings { hashes: 2, bits_per_key: 2.0 };

/// No other guesses than the first.
const NONE: MultiStartSettings = MultiStartSettings {
    fitness_below: 0.0,
    correction_above: f64::MAX,
    std_above: f64::MAX,
    motion_above: f64::MAX,
    motion_above_deg: f64::MAX,
    ascents: 0,
};

struct Run {
    poses: Vec<Pose>,
    expected_false_positives: f64,
}

/// Maps a sequence: the first scan at the origin, each next one aligned from the pose of the one before.
fn map_sequence(scans: &[Vec<Point>], settings: MapSettings, lookup: Lookup, method: Method) -> Run {
    let map = MultiResolutionMap::new(settings).unwrap();
    // One ascent a scan: the bound below counts every look-up as one of an absent voxel.
    let alignment = AlignmentSettings { lookup, method, multi_start: NONE, ..AlignmentSettings::default() };
    let mut run = Run { poses: vec![Pose::identity()], expected_false_positives: 0.0 };
    for (k, points) in scans.iter().enumerate() {
        if k > 0 {
            let aligned = align(&map, points, &run.poses[k - 1], &alignment);
            let levels = map.describe(0, 0).levels;
            let rates = levels.iter().filter_map(|level| level.filter).map(|filter| filter.expected_rate);
            let rate = rates.fold(0.0, f64::max);
            run.expected_false_positives += aligned.lookups as f64 * rate;
            run.poses.push(aligned.map_from_sensor);
        }
        let map_from_sensor = run.poses[k];
        map.committer().insert_scan(ScanRecord::of_points(pose_of(map_from_sensor), points, map.lattice()));
    }
    run
}

fn pose_of(map_from_sensor: Pose) -> MappedScan {
    MappedScan::new(RobotName::new("r").unwrap(), map_from_sensor)
}

fn assert_identical(name: &str, scans: &[Vec<Point>], resolution_m: f64, levels: u32) {
    for method in [Method::Overlap, Method::Refined] {
        assert_identical_by(method, name, scans, resolution_m, levels);
    }
}

fn assert_identical_by(method: Method, name: &str, scans: &[Vec<Point>], resolution_m: f64, levels: u32) {
    let map = |filter, lookup| {
        let settings = MapSettings { filter: Some(filter), ..MapSettings::new(resolution_m, levels) };
        map_sequence(scans, settings, lookup, method)
    };
    let exact = map(AMPLE, Lookup::Exact);
    let bloom = map(AMPLE, Lookup::Bloom);
    let small = map(SMALL, Lookup::Bloom);
    println!(
        "{name} by {method:?}: {} scans, {:.3} false positives to expect over the run with an ample filter, {:.0} with a small one",
        scans.len(),
        bloom.expected_false_positives,
        small.expected_false_positives
    );
    assert!(bloom.expected_false_positives < 1.0, "the filter is not ample");
    assert_eq!(bloom.poses, exact.poses);
    // The comparison has teeth: where false positives are common, poses do differ.
    assert_ne!(small.poses, exact.poses);
    if method == Method::Refined {
        let usual = map(FilterSettings::default(), Lookup::Bloom);
        for (k, (usual, exact)) in usual.poses.iter().zip(&exact.poses).enumerate() {
            let (meters, degrees) = pose_difference(usual, exact);
            assert!(meters <= 1e-4 && degrees <= 1e-3, "scan {k}: {meters} m, {degrees} degrees");
        }
    }
}

#[test]
fn poses_of_simulated_scans_are_identical_with_an_ample_filter() {
    let scene = Scene::furnished(3);
    for tour in tours(6) {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let scan = |pose: &Pose| -> Vec<Point> {
            let points = tour.sensor.scan(&scene, pose, &mut random);
            points.into_iter().filter(|point| point.is_finite()).collect()
        };
        let scans: Vec<_> = tour.poses.iter().map(scan).collect();
        assert_identical(tour.name, &scans, 0.05, 4);
    }
}

#[test]
fn poses_of_real_scans_are_identical_with_an_ample_filter() {
    for (name, scans, resolution_m, levels) in [("uos_3dtk_dat", 3, 0.1, 6), ("icl_office_kt0", 8, 0.04, 4)] {
        let Some(set) = shared_scans::open(name) else { continue };
        let scans: Vec<_> = (0..scans).map(|k| set.points(k)).collect();
        assert_identical(name, &scans, resolution_m, levels);
    }
}
