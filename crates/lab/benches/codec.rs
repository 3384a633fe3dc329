//! Messages: what a point query costs between the socket's bytes and the map, and back. And what is stored: the record
//! of a scan, a map file.

use bytes::Bytes;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mrol::map::{
    Change, Lookup, MapName, MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord,
};
use mrol::service::{MapVersion, PointAnswer, PointQuery};
use mrol::store::{Record, Snapshot};
use mrol::voxel::Lattice;
use mrol::wire::pb;
use mrol_lab::workload::{Order, Room, Site, Workload};
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
        version: MapVersion { revision: 7, map_uuid: uuid::Uuid::from_u128(7), content_hash: None },
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
        keep_out: false,
    };
    (&MapName::new("bench").expect("a name"), query).into()
}

fn stored(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("stored");
    group.throughput(Throughput::Elements(POINTS as u64));
    for (name, workload) in [("room", Workload::Room(Room)), ("site", Workload::Site(Site::of(1_000_000, 1)))]
    {
        let change = Change::Insertion(scan(workload));
        let record = Record::of(&change).expect("a record");
        println!("{name}: a record of {} bytes", record.len());
        group.bench_function(format!("encode the record of a scan of the {name}"), |bencher| {
            bencher.iter(|| Record::of(&change).expect("a record"));
        });
        let map = MultiResolutionMap::new(MapSettings::new(workload.resolution_m(), 4)).expect("settings");
        map.committer().apply(&change);
        let snapshot = Snapshot::of(&map, uuid::Uuid::from_u128(7));
        let file = snapshot.encode().expect("memory");
        group.bench_function(format!("encode a map of the {name}"), |bencher| {
            bencher.iter(|| snapshot.encode().expect("memory"));
        });
        group.bench_function(format!("decode a map of the {name}"), |bencher| {
            bencher.iter(|| Snapshot::decode(&file).expect("a map"));
        });
    }
    group.finish();
}

fn scan(workload: Workload) -> ScanRecord {
    let queries = workload.queries(Order::Scan, POINTS, 2);
    let lattice = Lattice::new(workload.resolution_m(), 4).expect("settings");
    let pose = MappedScan::new(RobotName::new("bench").expect("a name"), queries.map_from_points);
    ScanRecord::of_points(pose, &queries.points, &lattice)
}

criterion_group!(benches, codec, stored);
criterion_main!(benches);
