//! Instructions that the hot paths take, counted by valgrind: what they are does not depend on how busy the machine
//! is. Each has a limit a tenth above the count when it was last looked at (another compiler is no regression); who
//! makes a path longer on purpose raises it.
//!
//! Valgrind knows no AVX-512: counted are the AVX2 kernels and the scalar ones.

#![expect(missing_docs, reason = "the macros make modules without")]

use std::hint::black_box;

use bytes::Bytes;
use gungraun::prelude::*;
use gungraun::{Callgrind, EventKind};
use mrol::map::{Lookup, MapName, MapSettings, MultiResolutionMap};
use mrol::service::{MapVersion, PointAnswer, PointQuery};
use mrol::voxel::VoxelSet;
use mrol::wire::pb;
use mrol_lab::rivals::query_scalar;
use mrol_lab::workload::{Order, Queries, Room, Workload, add};
use prost::Message;

const POINTS: usize = 10_240;

fn limited(instructions: u64) -> LibraryBenchmarkConfig {
    let mut counting = Callgrind::default();
    counting.hard_limits([(EventKind::Ir, instructions)]);
    let mut config = LibraryBenchmarkConfig::default();
    config.tool(counting);
    config
}

fn empty() -> MultiResolutionMap {
    MultiResolutionMap::new(MapSettings::new(Room::RESOLUTION_M, 4)).expect("settings in range")
}

fn scan() -> Queries {
    Workload::Room(Room).queries(Order::Scan, POINTS, 2)
}

fn room(lookup: Lookup) -> (MultiResolutionMap, Queries, Lookup) {
    let map = Workload::Room(Room).map(MapSettings::new(Room::RESOLUTION_M, 4));
    (map.expect("settings in range"), scan(), lookup)
}

#[library_benchmark(setup = room)]
#[bench::bloom(args = (Lookup::Bloom), config = limited(375_000))]
#[bench::exact(args = (Lookup::Exact), config = limited(1_101_000))]
fn wide((map, queries, lookup): (MultiResolutionMap, Queries, Lookup)) -> [u64; POINTS / 64] {
    let mut occupied = [0; POINTS / 64];
    let quantize = map.lattice().from_points(&queries.map_from_points);
    let view = map.view_of(&queries.points, &queries.map_from_points);
    view.query(&queries.points, &quantize, 0, lookup, &mut occupied);
    drop(view);
    std::mem::forget((map, queries));
    occupied
}

#[library_benchmark(setup = room)]
#[bench::bloom(args = (Lookup::Bloom), config = limited(2_534_000))]
#[bench::exact(args = (Lookup::Exact), config = limited(3_942_000))]
fn scalar((map, queries, lookup): (MultiResolutionMap, Queries, Lookup)) -> [u64; POINTS / 64] {
    let mut occupied = [0; POINTS / 64];
    let quantize = map.lattice().from_points(&queries.map_from_points);
    let view = map.view();
    query_scalar(&view, &queries.points, &quantize, 0, lookup, &mut occupied);
    drop(view);
    std::mem::forget((map, queries));
    occupied
}

fn to_insert(times_known: usize) -> (MultiResolutionMap, Queries) {
    let (map, scan) = (empty(), scan());
    (0..times_known).for_each(|_| insert(&map, &scan));
    (map, scan)
}

fn insert(map: &MultiResolutionMap, scan: &Queries) {
    let quantize = map.lattice().from_points(&scan.map_from_points);
    add(map, VoxelSet::of_points(&scan.points, &quantize).0);
}

#[library_benchmark(setup = to_insert)]
#[bench::new(args = (0), config = limited(2_459_000))]
#[bench::known(args = (1), config = limited(1_802_000))]
fn inserted((map, scan): (MultiResolutionMap, Queries)) {
    insert(&map, &scan);
    std::mem::forget((map, scan));
}

fn question() -> pb::QueryPointsRequest {
    let queries = scan();
    let query = PointQuery {
        points: queries.points.into(),
        map_from_points: Some(queries.map_from_points),
        level: 0,
        lookup: Lookup::Bloom,
        min_revision: None,
        map_uuid: None,
        keep_out: false,
    };
    (&MapName::new("bench").expect("a name"), query).into()
}

fn encoded() -> Bytes {
    question().encode_to_vec().into()
}

#[library_benchmark(setup = encoded)]
#[bench::question(config = limited(2_756))]
fn decoded(message: Bytes) -> usize {
    let request = pb::QueryPointsRequest::decode(message).expect("a message");
    let (_, query) = <(MapName, PointQuery)>::try_from(request).expect("a question");
    black_box(query).points.len()
}

fn answer() -> PointAnswer {
    PointAnswer {
        occupied: vec![0x5a; POINTS / 8].into(),
        points: POINTS,
        points_occupied: POINTS / 2,
        version: MapVersion { revision: 7, map_uuid: uuid::Uuid::from_u128(7), content_hash: None },
    }
}

#[library_benchmark(setup = answer)]
#[bench::answer(config = limited(1_681))]
fn written(answer: PointAnswer) -> Vec<u8> {
    pb::QueryPointsResponse::from(answer).encode_to_vec()
}

library_benchmark_group!(name = lookup, benchmarks = [wide, scalar]);
library_benchmark_group!(name = change, benchmarks = inserted);
library_benchmark_group!(name = codec, benchmarks = [decoded, written]);

main!(library_benchmark_groups = [lookup, change, codec]);
