//! gRPC requests: their messages, one after the other, to a service in this process.

use axum::body::Body;
use axum::http::{HeaderMap, Request};
use mrol::grpc::routes;

use super::hosted::{Answer, Hosted, MESSAGE_BYTES_MAX};

const METHODS: [&str; 34] = [
    "Occupancy/QueryPoints",
    "Occupancy/QueryPointsStream",
    "Occupancy/ListVoxels",
    "Mapping/InsertScan",
    "Mapping/InsertScanStream",
    "Mapping/AlignScan",
    "Mapping/Localize",
    "Mapping/DeleteVoxels",
    "Mapping/Undo",
    "Mapping/GetTrajectory",
    "Mapping/StreamTrajectory",
    "Maps/CreateMap",
    "Maps/GetMap",
    "Maps/ListMaps",
    "Maps/DeleteMap",
    "Maps/SnapshotMap",
    "Maps/RestoreMap",
    // There is none of that name.
    "Maps/Explode",
    "Occupancy/GetBlock",
    "Occupancy/ListObservers",
    "Mapping/PutKeepOut",
    "Mapping/DeleteKeepOut",
    "Occupancy/ListKeepOuts",
    "Occupancy/CheckPoses",
    "Occupancy/CheckSpheres",
    "Occupancy/CheckMotions",
    "Occupancy/CastRays",
    "Occupancy/FindNearest",
    "Occupancy/ProjectGrid",
    "Occupancy/StreamGrid",
    "Occupancy/ClassifyPoints",
    "Occupancy/ListFrontiers",
    "Mapping/ListEvents",
    "Maps/RenameMap",
];
/// Status codes of defects: unknown, internal, data loss.
const DEFECTS: [&str; 3] = ["2", "13", "15"];

/// Asks for what the input says, and panics where the answer is a defect's, or a refusal changed something.
///
/// An input is a list of calls: a method, a length (u16, little-endian), and a message of so many bytes.
pub(super) fn grpc(mut calls: &[u8]) {
    thread_local! {
        static SERVED: Hosted = Hosted::new(|middleware| {
            let (routes, _health) = routes(middleware, MESSAGE_BYTES_MAX).expect("routes");
            routes.into_axum_router()
        });
    }
    SERVED.with(|hosted| {
        let mut maps_changed = false;
        while let Some((&[method, low, high], rest)) = calls.split_first_chunk() {
            let (message, rest) = rest.split_at(rest.len().min(u16::from_le_bytes([low, high]).into()));
            calls = rest;
            maps_changed |= call(hosted, METHODS[usize::from(method) % METHODS.len()], message);
        }
        hosted.reset(maps_changed);
    });
}

/// True where the call may have made a map or taken one away.
fn call(hosted: &Hosted, method: &str, message: &[u8]) -> bool {
    let before = hosted.revision();
    let answer = hosted.ask(request(method, message));
    let status = Status::of(&answer);
    let malformed = status.message.starts_with("failed%20to%20decode%20Protobuf%20message");
    assert!(!DEFECTS.contains(&&*status.code) || malformed, "{method}: {} {}", status.code, status.message);
    let done = status.code == "0";
    assert!(done || hosted.revision() == before, "{method} was refused and changed the map");
    done && ["Maps/CreateMap", "Maps/RenameMap", "Maps/DeleteMap", "Maps/RestoreMap"].contains(&method)
}

fn request(method: &str, message: &[u8]) -> Request<Body> {
    let frame = [&[0][..], &(message.len() as u32).to_be_bytes(), message].concat();
    let request = Request::post(format!("/mrol.v1.{method}"));
    let request = request.header("content-type", "application/grpc").header("te", "trailers");
    request.body(Body::from(frame)).expect("a request")
}

/// How a call ended.
struct Status {
    code: String,
    message: String,
}

impl Status {
    /// It comes behind the answer, or at once where there is none.
    fn of(answer: &Answer) -> Self {
        let text = |headers: &HeaderMap, name: &str| {
            headers.get(name).map(|value| String::from_utf8_lossy(value.as_bytes()).into_owned())
        };
        let field = |name: &str| text(&answer.trailers, name).or_else(|| text(&answer.headers, name));
        let code = field("grpc-status").expect("a status");
        Self { code, message: field("grpc-message").unwrap_or_default() }
    }
}
