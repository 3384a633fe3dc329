//! What the contract promises, over gRPC.

use std::time::{Duration, Instant};

use mrol::wire::pb;
use pb::delete_voxels_request::Target;
use pb::region::Shape;
use tokio_stream::StreamExt;
use tonic::codec::CompressionEncoding;
use tonic::{Code, Request, Status};

use crate::support::daemon::{
    Daemon, PATIENCE, bits_of, client, corner, guess_pb, points_pb, pose_pb, query_pb, row, scan_pb,
};

fn settings(resolution_m: f64, levels: u32) -> Option<pb::MapSettings> {
    Some(pb::MapSettings { resolution_m, levels: Some(levels), ..Default::default() })
}

fn reason(status: &Status) -> String {
    let word = status.metadata().get("mrol-reason").map(|word| word.to_str().unwrap_or_default());
    word.unwrap_or_default().to_owned()
}

#[tokio::test]
async fn a_map_is_made_described_listed_and_deleted() {
    let daemon = Daemon::start().await;
    let mut maps = daemon.maps().await;
    let create = pb::CreateMapRequest { map: "hall".into(), settings: settings(0.05, 3) };
    let made = maps.create_map(create.clone()).await.unwrap().into_inner();
    assert!(made.created);
    assert!(!maps.create_map(create).await.unwrap().into_inner().created);
    let other = pb::CreateMapRequest { map: "hall".into(), settings: settings(0.1, 3) };
    assert_eq!(maps.create_map(other).await.unwrap_err().code(), Code::AlreadyExists);

    let get = || pb::GetMapRequest { map: "hall".into() };
    let info = maps.get_map(get()).await.unwrap().into_inner().map.unwrap();
    assert_eq!(info.levels.len(), 3);
    assert!((info.levels[2].resolution_m - 0.2).abs() < 1e-12);
    assert_eq!(info.version.unwrap().revision, 0);
    let listed = maps.list_maps(pb::ListMapsRequest {}).await.unwrap().into_inner().maps;
    assert_eq!(listed.iter().map(|map| &map.map).collect::<Vec<_>>(), ["hall"]);

    maps.delete_map(pb::DeleteMapRequest { map: "hall".into() }).await.unwrap();
    let gone = maps.get_map(get()).await.unwrap_err();
    assert_eq!(gone.code(), Code::NotFound);
    assert!(gone.message().contains("hall"), "{gone}");
    assert!(!reason(&gone).is_empty());
}

#[tokio::test]
async fn a_map_made_again_has_another_uuid() {
    let daemon = Daemon::start().await;
    let mut maps = daemon.maps().await;
    let create = || pb::CreateMapRequest { map: "a".into(), settings: settings(0.1, 1) };
    let uuid_of = |made: pb::CreateMapResponse| made.map.unwrap().version.unwrap().map_uuid;
    let first = uuid_of(maps.create_map(create()).await.unwrap().into_inner());
    maps.delete_map(pb::DeleteMapRequest { map: "a".into() }).await.unwrap();
    let second = uuid_of(maps.create_map(create()).await.unwrap().into_inner());
    assert_ne!(first, second);
    daemon.put_in("a", &row(1)).await;
    let query = pb::QueryPointsRequest { map_uuid: first, min_revision: Some(1), ..query_pb("a", &row(1)) };
    let refused = daemon.occupancy().await.query_points(query).await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition);
}

#[tokio::test]
async fn an_inserted_scan_answers_queries_bit_by_bit() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut robot = daemon.mapping().await;
    let inserted = robot.insert_scan(scan_pb("a", "r", &row(3))).await.unwrap().into_inner();
    assert!(inserted.accepted && !inserted.replayed);
    assert_eq!((inserted.new_voxels, inserted.version.unwrap().revision), (3, 1));

    // Eleven points: two bytes, of which the first three bits and none else are set.
    let mut planner = daemon.occupancy().await;
    for lookup in [pb::Lookup::Exact, pb::Lookup::Bloom] {
        let query = pb::QueryPointsRequest { lookup: lookup.into(), ..query_pb("a", &row(11)) };
        let answer = planner.query_points(query).await.unwrap().into_inner();
        let bits = bits_of(&answer.occupied, 11);
        assert_eq!((answer.points, answer.occupied.len()), (11, 2));
        assert!(bits[..3].iter().all(|&bit| bit), "{lookup:?} denies an occupied voxel");
        if lookup == pb::Lookup::Exact {
            assert_eq!(answer.occupied[..], [0b111, 0]);
            assert_eq!(answer.points_occupied, 3);
        }
    }
    // Level 3 holds eight voxels of 0.1 m: the first eight points share one.
    let coarse = pb::QueryPointsRequest { level: 3, ..query_pb("a", &row(11)) };
    assert_eq!(planner.query_points(coarse).await.unwrap().into_inner().occupied[..], [0xff, 0]);
    // A pose moves the points: five voxels to the left of where they are.
    let moved = pb::QueryPointsRequest {
        map_from_points: Some(pose_pb([-0.5, 0.0, 0.0])),
        ..query_pb("a", &row(11))
    };
    assert_eq!(planner.query_points(moved).await.unwrap().into_inner().occupied[..], [0b1110_0000, 0]);
    // The other encoding of the same points.
    let floats = pb::Points { xyz: row(11).concat(), ..Default::default() };
    let packed = pb::QueryPointsRequest { points: Some(floats), ..query_pb("a", &[]) };
    assert_eq!(planner.query_points(packed).await.unwrap().into_inner().occupied[..], [0b111, 0]);
}

#[tokio::test]
async fn a_stream_of_queries_is_answered_in_order() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(100)).await;
    // The n-th question has n + 1 points; only the first one names the map.
    let name = |i: usize| if i == 0 { "a" } else { "" };
    let questions = (0..50).map(move |i| query_pb(name(i), &row(i + 1)));
    let mut planner = daemon.occupancy().await;
    let answers = planner.query_points_stream(tokio_stream::iter(questions)).await.unwrap().into_inner();
    let points: Vec<u64> = answers.map(|answer| answer.unwrap().points_occupied).collect().await;
    assert_eq!(points, (1..=50).collect::<Vec<u64>>());
}

#[tokio::test]
async fn a_scan_that_fails_is_an_answer_and_its_stream_goes_on() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let numbered = |id: u64, points: &[[f32; 3]]| {
        let mut request = scan_pb("a", "r", points);
        request.scan.as_mut().unwrap().scan_id = Some(id);
        request
    };
    let scans = [
        numbered(1, &row(1)),
        // The number is another scan's.
        numbered(1, &row(2)),
        scan_pb("a", "r 1", &row(3)),
        scan_pb("nowhere", "r", &row(3)),
        scan_pb("a", "r", &[[f32::NAN; 3]]),
        numbered(2, &row(2)),
    ];
    let mut robot = daemon.mapping().await;
    let answers = robot.insert_scan_stream(tokio_stream::iter(scans)).await.unwrap().into_inner();
    let answers: Vec<_> = answers.map(|answer| answer.unwrap()).collect().await;
    let failures: Vec<_> = answers
        .iter()
        .map(|answer| answer.error.as_ref().map(|error| (Code::from(error.code), error.reason.as_str())))
        .collect();
    let expected = [
        None,
        Some((Code::AlreadyExists, "scan_id_taken")),
        Some((Code::InvalidArgument, "bad_name")),
        Some((Code::NotFound, "map_not_found")),
        Some((Code::InvalidArgument, "no_returns")),
        None,
    ];
    assert_eq!(failures, expected);
    assert!(answers[2].error.as_ref().unwrap().message.contains("scan.robot"));
    assert!(answers[1].alignment.is_none() && answers[1].version.is_none());
    assert_eq!(answers[5].version.as_ref().unwrap().revision, 2);
    assert_eq!(daemon.contents("a").await.0, 2);
    for (code, count) in [("ok", 2.0), ("already_exists", 1.0), ("invalid_argument", 2.0), ("not_found", 1.0)]
    {
        let series =
            format!(r#"mrol_requests_total{{protocol="grpc",operation="InsertScanStream",code="{code}"}}"#);
        assert_eq!(daemon.metric(&series).await, Some(count), "{code}");
    }
}

#[tokio::test]
async fn a_message_that_cannot_be_read_ends_a_stream_of_scans() {
    let daemon = Daemon::start_with(|config| config.limits.message_bytes_max = 4096).await;
    daemon.make_map("a").await;
    let scans = [scan_pb("a", "r", &row(1)), scan_pb("a", "r", &row(1000)), scan_pb("a", "r", &row(2))];
    let mut robot = daemon.mapping().await;
    let mut answers = robot.insert_scan_stream(tokio_stream::iter(scans)).await.unwrap().into_inner();
    assert!(answers.message().await.unwrap().unwrap().accepted);
    let failed = answers.message().await.unwrap_err();
    assert_eq!((failed.code(), reason(&failed).as_str()), (Code::ResourceExhausted, "message_too_large"));
}

#[tokio::test]
async fn voxels_are_deleted_by_points_keys_box_and_sphere() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(40)).await;
    let mut planner = daemon.occupancy().await;
    let list = pb::ListVoxelsRequest { map: "a".into(), level: 1, ..Default::default() };
    let mut coarse = planner.list_voxels(list).await.unwrap().into_inner();
    let mut keys = coarse.message().await.unwrap().unwrap().keys;
    assert_eq!(keys.len(), 20);
    keys.sort_unstable();

    let vector = |x: f64| Some([x, 0.05, 0.05].into());
    let cuboid = pb::Box { min_m: vector(1.0), max_m: vector(1.5) };
    let ball = pb::Sphere { center_m: vector(2.05), radius_m: 0.1 };
    let region = |shape| Target::Region(pb::Region { shape: Some(shape) });
    let cases = [
        // Points of the first two voxels, and one of none.
        (Target::Points(points_pb(&[row(1)[0], row(2)[1], [-5.0, 0.0, 0.0]]).unwrap()), 0, 2),
        // The second and third voxel of level 1: the four of level 0 below them.
        (Target::Keys(pb::VoxelKeys { keys: keys[1..3].to_vec() }), 1, 4),
        // Centers from 1.05 to 1.45.
        (region(Shape::Box(cuboid)), 0, 5),
        // Centers 1.95 (about), 2.05 and 2.15.
        (region(Shape::Sphere(pb::Sphere { radius_m: 0.12, ..ball })), 0, 3),
        // All of it again.
        (region(Shape::Sphere(pb::Sphere { radius_m: 0.12, ..ball })), 0, 0),
    ];
    let mut robot = daemon.mapping().await;
    let mut left = 40;
    for (target, level, removed) in cases {
        let before = daemon.contents("a").await.0;
        let deletion = pb::DeleteVoxelsRequest {
            map: "a".into(),
            target: Some(target.clone()),
            level,
            ..Default::default()
        };
        let answer = robot.delete_voxels(deletion).await.unwrap().into_inner();
        left -= removed as usize;
        let (revision, voxels) = daemon.contents("a").await;
        assert_eq!((answer.removed, voxels.len()), (removed, left), "{target:?}");
        assert_eq!(revision, before + u64::from(removed > 0), "an empty deletion makes no revision");
        assert_eq!(answer.version.unwrap().revision, revision);
    }
}

#[tokio::test]
async fn a_trajectory_holds_the_accepted_scans_of_each_robot() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut robot = daemon.mapping().await;
    for (i, name) in ["one", "two", "one"].into_iter().enumerate() {
        let mut scan = scan_pb("a", name, &row(5));
        scan.guess = guess_pb([0.0, i as f64, 0.0]);
        let inner = scan.scan.as_mut().unwrap();
        (inner.scan_id, inner.timestamp_ns) = (Some(i as u64), Some(1000 + i as i64));
        robot.insert_scan(scan).await.unwrap();
    }
    let mut trajectory = async |name: &str| {
        let request = pb::GetTrajectoryRequest { map: "a".into(), robot: name.into(), ..Default::default() };
        robot.get_trajectory(request).await.unwrap().into_inner().poses
    };
    let all = trajectory("").await;
    assert_eq!(all.iter().map(|pose| pose.revision).collect::<Vec<_>>(), [1, 2, 3]);
    let one = trajectory("one").await;
    let of_one: Vec<_> = one.iter().map(|pose| (pose.scan_id, pose.timestamp_ns, pose.new_voxels)).collect();
    assert_eq!(of_one, [(Some(0), Some(1000), 5), (Some(2), Some(1002), 5)]);
    let place = one[1].map_from_sensor.unwrap().translation_m.unwrap();
    assert_eq!([place.x, place.y, place.z], [0.0, 2.0, 0.0]);
    assert!(trajectory("nobody").await.is_empty());
}

#[tokio::test]
async fn a_scan_sent_again_is_answered_as_the_first_time_and_another_under_its_id_is_a_conflict() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut robot = daemon.mapping().await;
    let scan = |points: &[[f32; 3]]| {
        let mut scan = scan_pb("a", "r", points);
        scan.scan.as_mut().unwrap().scan_id = Some(7);
        scan
    };
    let first = robot.insert_scan(scan(&row(4))).await.unwrap().into_inner();
    daemon.put_in("a", &row(9)).await;
    let again = robot.insert_scan(scan(&row(4))).await.unwrap().into_inner();
    assert!(again.replayed && again.accepted);
    // What the map held then is not known any more.
    let first_version = first.version.clone().map(|version| pb::MapVersion { content_hash: None, ..version });
    assert_eq!((&again.version, again.new_voxels), (&first_version, first.new_voxels));
    let poses = [&again, &first].map(|answer| answer.alignment.as_ref().unwrap().map_from_sensor);
    assert_eq!(poses[0], poses[1]);
    assert_eq!(daemon.contents("a").await.0, 2);
    let other = robot.insert_scan(scan(&row(5))).await.unwrap_err();
    assert_eq!(other.code(), Code::AlreadyExists);
    assert!(other.message().contains('7'), "{other}");
}

#[tokio::test]
async fn a_robot_without_a_guess_or_a_former_scan_is_asked_for_one() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let mut robot = daemon.mapping().await;
    let without = |name: &str| {
        let pb::InsertScanRequest { map, scan, .. } = scan_pb("a", name, &corner());
        pb::InsertScanRequest { map, scan, ..Default::default() }
    };
    // The first scan of an empty map needs none.
    assert!(robot.insert_scan(without("one")).await.unwrap().into_inner().accepted);
    let refused = robot.insert_scan(without("two")).await.unwrap_err();
    assert_eq!((refused.code(), reason(&refused).as_str()), (Code::FailedPrecondition, "guess_required"));
    // Who has an accepted scan needs none either.
    assert!(robot.insert_scan(without("one")).await.unwrap().into_inner().accepted);
}

#[tokio::test]
async fn a_scan_from_elsewhere_is_refused_by_an_answer_and_aligning_changes_nothing() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &corner()).await;
    let before = daemon.contents("a").await;
    let far = pb::InsertScanRequest {
        guess: guess_pb([500.0; 3]),
        at_guess: false,
        ..scan_pb("a", "r", &corner())
    };
    let mut robot = daemon.mapping().await;
    let refused = robot.insert_scan(far).await.unwrap().into_inner();
    let alignment = refused.alignment.unwrap();
    assert!(!refused.accepted && refused.new_voxels == 0);
    assert_eq!(alignment.verdict, i32::from(pb::Verdict::LowOverlap));
    assert!(alignment.reason.starts_with("0.000 and 0.000"), "{}", alignment.reason);
    assert_eq!((alignment.overlap, alignment.level_overlaps.len()), (0.0, 4));

    let pb::InsertScanRequest { map, scan, guess, .. } = scan_pb("a", "r", &corner());
    let align = pb::AlignScanRequest { map, scan, guess, ..Default::default() };
    let aligned = robot.align_scan(align).await.unwrap().into_inner();
    let alignment = aligned.alignment.unwrap();
    assert!(aligned.accepted && alignment.overlap > 0.99, "{alignment:?}");
    assert!(alignment.inliers > 0.9 && alignment.undetermined.is_empty() && alignment.align_ms > 0.0);
    let diagonal = (0..6).map(|i| alignment.information[7 * i]);
    assert_eq!(diagonal.filter(|known| *known > 0.0).count(), 6);
    assert_eq!(daemon.contents("a").await, before);
}

#[tokio::test]
async fn a_read_waits_for_its_revision_or_its_deadline() {
    let later = || pb::QueryPointsRequest { min_revision: Some(1), ..query_pb("a", &row(3)) };
    let daemon = Daemon::start_with(|config| config.limits.min_revision_wait_max_s = 0.2).await;
    daemon.make_map("a").await;
    let bounded = daemon.occupancy().await.query_points(later()).await.unwrap_err();
    assert_eq!(bounded.code(), Code::DeadlineExceeded);
    assert!(bounded.message().contains('1'), "{bounded}");

    let patience = PATIENCE.as_secs_f64();
    let daemon = Daemon::start_with(|config| config.limits.min_revision_wait_max_s = patience).await;
    daemon.make_map("a").await;
    let mut planner = daemon.occupancy().await;
    // The client looks at the same clock, and calls it cancelled where it is the first to notice.
    let mut is_told = false;
    for _ in 0..20 {
        let mut hurried = Request::new(later());
        hurried.set_timeout(Duration::from_millis(60));
        let hurried = planner.query_points(hurried).await.unwrap_err();
        assert!(matches!(hurried.code(), Code::DeadlineExceeded | Code::Cancelled), "{hurried}");
        is_told |= hurried.code() == Code::DeadlineExceeded;
        if is_told {
            break;
        }
    }
    assert!(is_told, "the server does not keep the deadline of a call");

    let second = [row(2)[1]];
    let (answer, _) = tokio::join!(planner.query_points(later()), daemon.put_in("a", &second));
    let answer = answer.unwrap().into_inner();
    assert_eq!((answer.occupied[0], answer.version.unwrap().revision), (0b10, 1));
}

#[tokio::test]
async fn who_waits_for_a_revision_hears_of_the_maps_end_at_once() {
    let patience = 10.0 * PATIENCE.as_secs_f64();
    let daemon = Daemon::start_with(|config| config.limits.min_revision_wait_max_s = patience).await;
    for (map, code, word) in [
        ("gone", Code::NotFound, "map_not_found"),
        ("renamed", Code::NotFound, "map_not_found"),
        ("other", Code::FailedPrecondition, "map_replaced"),
    ] {
        daemon.make_map(map).await;
        let path = format!("/v1/maps/{map}/snapshot");
        let file = daemon.get(&path).await.bytes().await.unwrap();
        let mut planner = daemon.occupancy().await;
        let later = pb::QueryPointsRequest { min_revision: Some(9), ..query_pb(map, &row(3)) };
        let waiting = tokio::spawn(async move { planner.query_points(later).await });
        // It waits when the metrics say that it is in work.
        let start = Instant::now();
        while daemon.metric("mrol_requests_in_flight{state=\"in_work\"}").await != Some(1.0) {
            assert!(start.elapsed() < PATIENCE, "it never begins");
            tokio::task::yield_now().await;
        }
        let ended = match map {
            "gone" => daemon.delete("/v1/maps/gone").await,
            "renamed" => daemon.post("/v1/maps/renamed/rename", serde_json::json!({"to": "new"})).await,
            _ => {
                let put = client().put(daemon.url(&format!("{path}?replace=true")));
                put.header("content-type", "application/octet-stream").body(file).send().await.unwrap()
            }
        };
        assert!(ended.status().is_success(), "{map}: {}", ended.status());
        let told = tokio::time::timeout(PATIENCE, waiting).await.expect("it is told at once");
        let told = told.unwrap().unwrap_err();
        assert_eq!((told.code(), &*reason(&told)), (code, word));
    }
}

#[tokio::test]
async fn a_listing_is_streamed_whole_by_region_and_by_level() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    // A floor of 300 x 300 voxels: more than one message of keys.
    let floor: Vec<[f32; 3]> =
        (0..90_000).map(|i| [(i % 300) as f32 * 0.1 + 0.05, (i / 300) as f32 * 0.1 + 0.05, 0.05]).collect();
    daemon.mapping().await.insert_scan(scan_pb("a", "r", &floor)).await.unwrap();
    let mut planner = daemon.occupancy().await;
    let mut list = async |level, region| {
        let request = pb::ListVoxelsRequest { map: "a".into(), level, region, ..Default::default() };
        let chunks = planner.list_voxels(request).await.unwrap().into_inner();
        let chunks: Vec<_> = chunks.map(|chunk| chunk.unwrap()).collect().await;
        assert!(chunks.iter().all(|chunk| chunk.keys.len() <= 65_536 && chunk.version.is_some()));
        (chunks.len(), chunks.iter().map(|chunk| chunk.keys.len()).sum::<usize>())
    };
    assert_eq!(list(0, None).await, (2, 90_000));
    assert_eq!(list(2, None).await, (1, 75 * 75));
    let corner = pb::Box { min_m: Some([0.0; 3].into()), max_m: Some([1.0; 3].into()) };
    let corner = pb::Region { shape: Some(Shape::Box(corner)) };
    assert_eq!(list(0, Some(corner)).await, (1, 100));
    let nowhere = pb::Sphere { center_m: Some([0.0, 0.0, 9.0].into()), radius_m: 1.0 };
    assert_eq!(list(0, Some(pb::Region { shape: Some(Shape::Sphere(nowhere)) })).await, (1, 0));
}

#[tokio::test]
async fn messages_may_be_compressed_both_ways() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(3)).await;
    for encoding in [CompressionEncoding::Gzip, CompressionEncoding::Zstd] {
        let mut planner = daemon.occupancy().await.send_compressed(encoding).accept_compressed(encoding);
        let answer = planner.query_points(query_pb("a", &row(1000))).await.unwrap();
        assert_eq!(answer.metadata().get("grpc-encoding").unwrap(), encoding.to_string().as_str());
        assert_eq!(answer.into_inner().points_occupied, 3);
    }
}

#[tokio::test]
async fn health_and_reflection_are_served() {
    use tonic_health::pb::{HealthCheckRequest, health_client::HealthClient};
    use tonic_reflection::pb::v1::{
        ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
        server_reflection_request::MessageRequest, server_reflection_response::MessageResponse,
    };
    let daemon = Daemon::start().await;
    let mut health = HealthClient::new(daemon.channel().await);
    for service in ["", "mrol.v1.Occupancy", "mrol.v1.Mapping", "mrol.v1.Maps"] {
        let check = HealthCheckRequest { service: service.into() };
        assert_eq!(health.check(check).await.unwrap().into_inner().status, 1, "{service}");
    }
    let list = MessageRequest::ListServices(String::new());
    let list = ServerReflectionRequest { host: String::new(), message_request: Some(list) };
    let mut reflection = ServerReflectionClient::new(daemon.channel().await);
    let answers = reflection.server_reflection_info(tokio_stream::once(list)).await.unwrap();
    let answer = answers.into_inner().message().await.unwrap().unwrap().message_response.unwrap();
    let MessageResponse::ListServicesResponse(services) = answer else { panic!("{answer:?}") };
    let names: Vec<_> = services.service.iter().map(|service| service.name.as_str()).collect();
    for name in ["mrol.v1.Occupancy", "mrol.v1.Mapping", "mrol.v1.Maps", "grpc.health.v1.Health"] {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
}
