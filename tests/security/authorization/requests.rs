//! A request of each operation that makes sense, in both protocols. An operation that is new has none and does not
//! compile.

use mrol::access::Operation;
use mrol::wire::pb;
use prost::Message;
use serde_json::{Value, json};
use tonic_health::pb::HealthCheckRequest;
use tonic_reflection::pb::v1::ServerReflectionRequest;
use tonic_reflection::pb::v1::server_reflection_request::MessageRequest;

use crate::support::daemon::{guess_pb, identity_json, points_pb, query_pb, scan_pb};

const POINTS: [[f32; 3]; 1] = [[1.0, 2.0, 3.0]];
const POSE: [f32; 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

fn body_json() -> Value {
    json!({"links": [{"spheres": [[0, 0, 0, 0.1]]}]})
}

/// The bytes of the gRPC message, about `map`.
pub(crate) fn message(operation: Operation, map: &str) -> Vec<u8> {
    let map = map.to_owned();
    match operation {
        Operation::QueryPoints | Operation::QueryPointsStream => query_pb(&map, &POINTS).encode_to_vec(),
        Operation::ListVoxels => pb::ListVoxelsRequest { map, ..Default::default() }.encode_to_vec(),
        Operation::CheckPoses | Operation::CheckPosesStream => {
            let (asked, body) = (asked(map), Some(body_pb()));
            pb::CheckPosesRequest { asked, body, configurations_f32le: pose(), ..Default::default() }
                .encode_to_vec()
        }
        Operation::CheckSpheres | Operation::CheckSpheresStream => pb::CheckSpheresRequest {
            asked: asked(map),
            spheres_f32le: sphere(),
            sizes_u32le: 1u32.to_le_bytes().to_vec().into(),
            ..Default::default()
        }
        .encode_to_vec(),
        Operation::CheckMotions | Operation::CheckMotionsStream => pb::CheckMotionsRequest {
            asked: asked(map),
            body: Some(body_pb()),
            configurations_f32le: [pose(), pose()].concat().into(),
            lengths_u32le: 2u32.to_le_bytes().to_vec().into(),
            ..Default::default()
        }
        .encode_to_vec(),
        Operation::CastRays | Operation::CastRaysStream => pb::CastRaysRequest {
            asked: asked(map),
            origins: points_pb(&POINTS),
            directions: points_pb(&[[1.0, 0.0, 0.0]]),
            ..Default::default()
        }
        .encode_to_vec(),
        Operation::FindNearest | Operation::FindNearestStream => {
            let (asked, points) = (asked(map), points_pb(&POINTS));
            pb::FindNearestRequest { asked, points, radius_m: 1.0, ..Default::default() }.encode_to_vec()
        }
        Operation::ClassifyPoints | Operation::ClassifyPointsStream => {
            pb::ClassifyPointsRequest { asked: asked(map), points: points_pb(&POINTS) }.encode_to_vec()
        }
        Operation::ListFrontiers => {
            let corner = |c: f64| Some(pb::Vector3 { x: c, y: c, z: c });
            let r#box = Some(pb::Box { min_m: corner(0.0), max_m: corner(1.0) });
            pb::ListFrontiersRequest { asked: asked(map), r#box, ..Default::default() }.encode_to_vec()
        }
        Operation::ProjectGrid | Operation::StreamGrid => {
            pb::ProjectGridRequest { asked: asked(map), ..Default::default() }.encode_to_vec()
        }
        Operation::ListKeepOuts => pb::ListKeepOutsRequest { map }.encode_to_vec(),
        Operation::PutKeepOut => {
            let prism =
                pb::Prism { corners_m: vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0], z_from_m: 0.0, z_to_m: 1.0 };
            let shape = Some(pb::KeepOutShape { shape: Some(pb::keep_out_shape::Shape::Prism(prism)) });
            pb::PutKeepOutRequest { map, name: "dock".into(), shape, ..Default::default() }.encode_to_vec()
        }
        Operation::DeleteKeepOut => {
            pb::DeleteKeepOutRequest { map, name: "dock".into(), ..Default::default() }.encode_to_vec()
        }
        Operation::GetBlock => pb::GetBlockRequest { map, ..Default::default() }.encode_to_vec(),
        Operation::ListObservers => {
            let voxel = Some(pb::list_observers_request::Voxel::Key(0));
            pb::ListObserversRequest { map, voxel, ..Default::default() }.encode_to_vec()
        }
        Operation::Watch => pb::WatchRequest { map, ..Default::default() }.encode_to_vec(),
        Operation::ListEvents => pb::ListEventsRequest { map, ..Default::default() }.encode_to_vec(),
        Operation::WatchEvents => pb::WatchEventsRequest { map, ..Default::default() }.encode_to_vec(),
        Operation::InsertScan | Operation::InsertScanStream => scan_pb(&map, "r", &POINTS).encode_to_vec(),
        Operation::AlignScan => {
            let scan = Some(pb::Scan { robot: "r".into(), points: points_pb(&POINTS), ..Default::default() });
            pb::AlignScanRequest { map, scan, guess: guess_pb([0.0; 3]), ..Default::default() }
                .encode_to_vec()
        }
        Operation::Localize => {
            pb::LocalizeRequest { map, points: points_pb(&POINTS), ..Default::default() }.encode_to_vec()
        }
        Operation::DeleteVoxels => {
            let target = points_pb(&POINTS).map(pb::delete_voxels_request::Target::Points);
            pb::DeleteVoxelsRequest { map, target, ..Default::default() }.encode_to_vec()
        }
        Operation::Undo => {
            let scan = pb::RobotScan { robot: "r".into(), scan_id: 1, ..Default::default() };
            let target = Some(pb::undo_request::Target::Scan(scan));
            pb::UndoRequest { map, target, ..Default::default() }.encode_to_vec()
        }
        Operation::GetTrajectory => pb::GetTrajectoryRequest { map, ..Default::default() }.encode_to_vec(),
        Operation::StreamTrajectory => {
            pb::StreamTrajectoryRequest { map, ..Default::default() }.encode_to_vec()
        }
        Operation::CreateMap => {
            let settings = Some(pb::MapSettings { resolution_m: 0.1, levels: Some(2), ..Default::default() });
            pb::CreateMapRequest { map, settings }.encode_to_vec()
        }
        Operation::GetMap => pb::GetMapRequest { map }.encode_to_vec(),
        Operation::ListMaps => pb::ListMapsRequest {}.encode_to_vec(),
        Operation::RenameMap => pb::RenameMapRequest { to: map.clone(), map }.encode_to_vec(),
        Operation::DeleteMap => pb::DeleteMapRequest { map }.encode_to_vec(),
        Operation::SnapshotMap => pb::SnapshotMapRequest { map }.encode_to_vec(),
        Operation::RestoreMap => {
            pb::RestoreMapRequest { map, data: b"no map file"[..].into(), replace: false }.encode_to_vec()
        }
        Operation::Reflect => {
            let message_request = Some(MessageRequest::ListServices(String::new()));
            ServerReflectionRequest { message_request, ..Default::default() }.encode_to_vec()
        }
        Operation::HealthCheck | Operation::HealthWatch => HealthCheckRequest::default().encode_to_vec(),
        Operation::ShowViewer
        | Operation::GetViewerFile
        | Operation::Live
        | Operation::Ready
        | Operation::Metrics
        | Operation::DescribeApi
        | Operation::ReadApi
        | Operation::ReadApiFile => Vec::new(),
    }
}

/// What questions have in common.
fn asked(map: String) -> Option<pb::Asked> {
    Some(pb::Asked { map, ..Default::default() })
}

/// A sphere of 0.1 m.
fn sphere() -> prost::bytes::Bytes {
    [0.0f32, 0.0, 0.0, 0.1].iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// The identity as a configuration.
fn pose() -> prost::bytes::Bytes {
    [0.0f32, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn body_pb() -> pb::Body {
    pb::Body { links: vec![pb::Link { spheres_f32le: sphere(), ..Default::default() }] }
}

/// The body of the HTTP request.
pub(crate) fn body(operation: Operation) -> Option<Value> {
    match operation {
        Operation::QueryPoints | Operation::Localize | Operation::DeleteVoxels => {
            Some(json!({"points": POINTS}))
        }
        Operation::InsertScan | Operation::AlignScan => {
            Some(json!({"robot": "r", "points": POINTS, "guess": identity_json(), "align": false}))
        }
        Operation::CheckPoses => Some(json!({"body": body_json(), "configurations": [POSE]})),
        Operation::CheckSpheres => Some(json!({"spheres": [[0, 0, 0, 0.1]]})),
        Operation::CheckMotions => {
            Some(json!({"body": body_json(), "configurations": [POSE, POSE], "lengths": [2]}))
        }
        Operation::CastRays => Some(json!({"origins": POINTS, "directions": [[1, 0, 0]]})),
        Operation::FindNearest => Some(json!({"points": POINTS, "radius_m": 1})),
        Operation::ClassifyPoints => Some(json!({"points": POINTS})),
        Operation::ListFrontiers => Some(json!({"box": {"min_m": [0, 0, 0], "max_m": [1, 1, 1]}})),
        Operation::ProjectGrid | Operation::StreamGrid => Some(json!({})),
        Operation::Undo => Some(json!({"robot": "r", "scan_id": 1})),
        Operation::PutKeepOut => Some(json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}})),
        Operation::CreateMap => Some(json!({"resolution_m": 0.1, "levels": 2})),
        Operation::RenameMap => Some(json!({"to": "own"})),
        _ => None,
    }
}

/// Whether a request of the operation names a map.
pub(crate) fn names_a_map(operation: Operation) -> bool {
    match operation {
        Operation::QueryPoints
        | Operation::QueryPointsStream
        | Operation::ListVoxels
        | Operation::CheckPoses
        | Operation::CheckPosesStream
        | Operation::CheckSpheres
        | Operation::CheckSpheresStream
        | Operation::CheckMotions
        | Operation::CheckMotionsStream
        | Operation::CastRays
        | Operation::CastRaysStream
        | Operation::FindNearest
        | Operation::FindNearestStream
        | Operation::ClassifyPoints
        | Operation::ClassifyPointsStream
        | Operation::ListFrontiers
        | Operation::ProjectGrid
        | Operation::StreamGrid
        | Operation::ListKeepOuts
        | Operation::PutKeepOut
        | Operation::DeleteKeepOut
        | Operation::GetBlock
        | Operation::ListObservers
        | Operation::Watch
        | Operation::ListEvents
        | Operation::WatchEvents
        | Operation::InsertScan
        | Operation::InsertScanStream
        | Operation::AlignScan
        | Operation::Localize
        | Operation::DeleteVoxels
        | Operation::Undo
        | Operation::GetTrajectory
        | Operation::StreamTrajectory
        | Operation::CreateMap
        | Operation::GetMap
        | Operation::RenameMap
        | Operation::DeleteMap
        | Operation::SnapshotMap
        | Operation::RestoreMap => true,
        Operation::ListMaps
        | Operation::Reflect
        | Operation::HealthCheck
        | Operation::HealthWatch
        | Operation::ShowViewer
        | Operation::GetViewerFile
        | Operation::Live
        | Operation::Ready
        | Operation::Metrics
        | Operation::DescribeApi
        | Operation::ReadApi
        | Operation::ReadApiFile => false,
    }
}
