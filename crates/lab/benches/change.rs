//! Changes: points in voxels that are not there, in voxels that are, and out again; all levels and filters.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use mrol::map::{MapSettings, MultiResolutionMap};
use mrol::voxel::{Lattice, VoxelSet};
use mrol_lab::workload::{Order, Queries, Room, Site, Workload, add};

const POINTS: usize = 50_000;
const LEVELS: u32 = 4;

fn change(criterion: &mut Criterion) {
    for (name, workload) in
        [("change/room", Workload::Room(Room)), ("change/site", Workload::Site(Site::of(1_000_000, 1)))]
    {
        let settings = MapSettings::new(workload.resolution_m(), LEVELS);
        let lattice = Lattice::new(workload.resolution_m(), LEVELS).expect("settings in range");
        let seen = workload.queries(Order::Scan, 10 * POINTS, 2);
        let points = seen.first_of_each_voxel(|pose| lattice.from_points(pose), POINTS);
        changes(criterion, name, settings, &points);
    }
}

fn changes(criterion: &mut Criterion, name: &str, settings: MapSettings, points: &Queries) {
    let empty = || MultiResolutionMap::new(settings).expect("settings in range");
    let full = || {
        let map = empty();
        add(&map, voxels(&map, points));
        map
    };
    let known = full();
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(points.points.len() as u64));
    group.bench_function("insert new", |bencher| {
        bencher.iter_batched(
            empty,
            |map| {
                add(&map, voxels(&map, points));
                map
            },
            BatchSize::LargeInput,
        );
    });
    group.bench_function("insert known", |bencher| bencher.iter(|| add(&known, voxels(&known, points))));
    group.bench_function("remove", |bencher| {
        let remove = |map: MultiResolutionMap| {
            map.committer().remove(&voxels(&map, points));
            map
        };
        bencher.iter_batched(full, remove, BatchSize::LargeInput);
    });
    group.finish();
}

fn voxels(map: &MultiResolutionMap, points: &Queries) -> VoxelSet {
    VoxelSet::of_points(&points.points, &map.lattice().from_points(&points.map_from_points)).0
}

criterion_group!(benches, change);
criterion_main!(benches);
