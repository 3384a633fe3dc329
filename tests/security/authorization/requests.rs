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

/// The bytes of the gRPC message, about `map`.
pub(crate) fn message(operation: Operation, map: &str) -> Vec<u8> {
    let map = map.to_owned();
    match operation {
        Operation::QueryPoints | Operation::QueryPointsStream => query_pb(&map, &POINTS).encode_to_vec(),
        Operation::ListVoxels => pb::ListVoxelsRequest { map, ..Default::default() }.encode_to_vec(),
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
        Operation::Live | Operation::Ready | Operation::Metrics => Vec::new(),
    }
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
        Operation::Undo => Some(json!({"robot": "r", "scan_id": 1})),
        Operation::PutKeepOut => Some(json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}})),
        Operation::CreateMap => Some(json!({"resolution_m": 0.1, "levels": 2})),
        _ => None,
    }
}

/// Whether a request of the operation names a map.
pub(crate) fn names_a_map(operation: Operation) -> bool {
    match operation {
        Operation::QueryPoints
        | Operation::QueryPointsStream
        | Operation::ListVoxels
        | Operation::ListKeepOuts
        | Operation::PutKeepOut
        | Operation::DeleteKeepOut
        | Operation::GetBlock
        | Operation::ListObservers
        | Operation::Watch
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
        | Operation::DeleteMap
        | Operation::SnapshotMap
        | Operation::RestoreMap => true,
        Operation::ListMaps
        | Operation::Reflect
        | Operation::HealthCheck
        | Operation::HealthWatch
        | Operation::Live
        | Operation::Ready
        | Operation::Metrics => false,
    }
}
