//! Messages: what a point query costs between the socket's bytes and the map, and back.

use bytes::Bytes;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mrol::bench::workload::{Order, Room, Workload};
use mrol::map::{Lookup, MapName};
use mrol::service::{MapState, PointAnswer, PointQuery};
use mrol::wire::pb;
use prost::Message;

const POINTS: usize = 100_000;

fn codec(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("codec");
    group.throughput(Throughput::Elements(POINTS as u64));
    let encoded = Bytes::from(question().encode_to_vec());
    group.bench_function("decode a question", |bencher| {
        bencher.iter(|| {
            let request = pb::QueryPointsRequest::decode(encoded.clone()).expect("a message");
            <(MapName, PointQuery)>::try_from(request).expect("a question")
        });
    });
    group.bench_function("encode a question", |bencher| {
        let question = question();
        bencher.iter(|| question.encode_to_vec());
    });
    let answer = PointAnswer {
        occupied: vec![0x5a; POINTS.div_ceil(8)].into(),
        points: POINTS,
        points_occupied: POINTS / 2,
        state: MapState { revision: 7, map_uuid: uuid::Uuid::from_u128(7) },
    };
    group.bench_function("encode an answer", |bencher| {
        bencher.iter(|| pb::QueryPointsResponse::from(answer.clone()).encode_to_vec());
    });
    group.finish();
}

fn question() -> pb::QueryPointsRequest {
    let queries = Workload::Room(Room).queries(Order::Scan, POINTS, 2);
    let query = PointQuery {
        points: queries.points.into(),
        map_from_points: Some(queries.map_from_points),
        level: 0,
        lookup: Lookup::Bloom,
        min_revision: None,
        map_uuid: None,
    };
    (&MapName::new("bench").expect("a name"), query).into()
}

criterion_group!(benches, codec);
criterion_main!(benches);
