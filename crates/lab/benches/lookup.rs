//! Look-ups: points and a pose in, a bit a point out; a hundred thousand points a time, in scan order.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mrol::map::{Lookup, MapSettings, MultiResolutionMap};
use mrol::util::Keyword;
use mrol::voxel::quantize;
use mrol_lab::rivals::StructureName;
use mrol_lab::rivals::{filter_contains, query_scalar};
use mrol_lab::workload::{Order, Room, Site, Workload};

const POINTS: usize = 100_000;
const STRUCTURES: [StructureName; 7] = [
    StructureName::BloomKernel,
    StructureName::Bloom,
    StructureName::ExactKernel,
    StructureName::Exact,
    StructureName::Hashset,
    StructureName::Dense,
    StructureName::Paper,
];

fn room(criterion: &mut Criterion) {
    structures(criterion, "lookup/room", Workload::Room(Room));
}

fn small_site(criterion: &mut Criterion) {
    structures(criterion, "lookup/site of 1 M", Workload::Site(Site::of(1_000_000, 1)));
}

fn structures(criterion: &mut Criterion, name: &str, workload: Workload) {
    let map = workload.map(MapSettings::new(workload.resolution_m(), 4)).expect("settings in range");
    let queries = workload.queries(Order::Scan, POINTS, 2);
    let mut occupied = vec![0; POINTS.div_ceil(64)];
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(POINTS as u64));
    for structure in STRUCTURES {
        let built = structure.build(&map, 0).expect("an array that fits");
        group.bench_function(structure.as_str(), |bencher| {
            bencher
                .iter(|| built.occupied(&queries.points, &queries.map_from_points, black_box(&mut occupied)));
        });
    }
    group.finish();
}

/// The parts of a look-up, and the kernels as machines without wide instructions run them.
fn parts(criterion: &mut Criterion) {
    let map = Workload::Room(Room).map(MapSettings::new(0.05, 4)).expect("settings in range");
    let mut group = criterion.benchmark_group("lookup/room, parts");
    group.throughput(Throughput::Elements(POINTS as u64));
    scalar(&mut group, &map);
    let queries = Workload::Room(Room).queries(Order::Scan, POINTS, 2);
    let quantize = map.lattice().from_points(&queries.map_from_points);
    let (mut keys, mut occupied) = (vec![0; POINTS], vec![0; POINTS.div_ceil(64)]);
    group.bench_function("transform", |bencher| {
        bencher.iter(|| quantize::keys(&queries.points, &quantize, 0, black_box(&mut keys)));
    });
    let view = map.view();
    group.bench_function("filter alone", |bencher| {
        bencher.iter(|| filter_contains(&view, &keys, 0, black_box(&mut occupied)));
    });
    group.finish();
}

type Group<'a> = criterion::BenchmarkGroup<'a, criterion::measurement::WallTime>;

fn scalar(group: &mut Group<'_>, map: &MultiResolutionMap) {
    let queries = Workload::Room(Room).queries(Order::Scan, POINTS, 2);
    let quantize = map.lattice().from_points(&queries.map_from_points);
    let mut occupied = vec![0; POINTS.div_ceil(64)];
    let view = map.view();
    for lookup in [Lookup::Bloom, Lookup::Exact] {
        group.bench_function(format!("{} scalar", lookup.as_str()), |bencher| {
            let points = &queries.points;
            bencher.iter(|| query_scalar(&view, points, &quantize, 0, lookup, black_box(&mut occupied)));
        });
    }
}

criterion_group!(benches, room, small_site, parts);
criterion_main!(benches);
