//! Alignments: a simulated lidar scan to the map of the one before it.

use criterion::{Criterion, criterion_group, criterion_main};
use mrol::align::{AlignmentSettings, Method, align};
use mrol::geometry::{Point, Pose};
use mrol::map::{Lookup, MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol::util::Keyword;
use mrol::voxel::volumetric_sample;
use mrol_simulate::{Scene, Tour, tours};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn alignment(criterion: &mut Criterion) {
    let [lidar, _] = tours(2);
    let [first, second] = [scan(&lidar, 0), scan(&lidar, 1)];
    let map = map_of(&first, &lidar.poses[0]);
    let mut group = criterion.benchmark_group("align");
    group.sample_size(20);
    let ways = [
        (Method::Refined, Lookup::Bloom),
        (Method::Refined, Lookup::Exact),
        (Method::Overlap, Lookup::Bloom),
    ];
    for (method, lookup) in ways {
        let settings = AlignmentSettings { method, lookup, ..AlignmentSettings::default() };
        group.bench_function(format!("{} {}", method.as_str(), lookup.as_str()), |bencher| {
            bencher.iter(|| align(&map, &second, &lidar.poses[0], &settings));
        });
    }
    group.bench_function("volumetric sample", |bencher| bencher.iter(|| volumetric_sample(&second, 1000, 0)));
    group.finish();
}

fn scan(tour: &Tour, step: usize) -> Vec<Point> {
    let mut random = ChaCha8Rng::seed_from_u64(step as u64);
    let mut points = tour.sensor.scan(&Scene::furnished(1), &tour.poses[step], &mut random);
    points.retain(|point| point.is_finite());
    points
}

fn map_of(points: &[Point], map_from_sensor: &Pose) -> MultiResolutionMap {
    let map = MultiResolutionMap::new(MapSettings::new(0.05, 4)).expect("settings in range");
    let pose = MappedScan::new(RobotName::new("r").expect("a name"), *map_from_sensor);
    map.committer().insert_scan(ScanRecord::of_points(pose, points, map.lattice()));
    map
}

criterion_group!(benches, alignment);
criterion_main!(benches);
