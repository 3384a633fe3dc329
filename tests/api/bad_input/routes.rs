//! Every route of the access table with what it does not take: a parameter, a body that is an array, garbage.

use mrol::access::{Operation, Route};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use super::{assert_refused, assert_unchanged, daemon, refused};
use crate::support::daemon::{Daemon, bytes_of, client, identity_json, json_of, row};

/// What a route's body is.
enum Body {
    /// None, whatever is sent.
    None,
    /// JSON alone; one that is taken.
    Json(Value),
    /// JSON, or points as bytes with the rest in these parameters.
    Points(Value, &'static str),
    /// A map file.
    File,
}

fn ball() -> Value {
    json!({"links": [{"spheres": [[0, 0, 0, 0.1]]}]})
}

/// A body that is taken, by operation. An operation that is new has none and does not compile.
fn body(operation: Operation) -> Body {
    let scan = || json!({"robot": "r", "points": row(1), "guess": identity_json(), "align": false});
    match operation {
        Operation::QueryPoints => Body::Points(json!({"points": row(1)}), ""),
        Operation::Localize => Body::Points(json!({"points": row(1)}), ""),
        Operation::DeleteVoxels => Body::Points(json!({"points": [[9.0, 9.0, 9.0]]}), ""),
        Operation::InsertScan | Operation::AlignScan => Body::Points(scan(), "robot=r&"),
        Operation::CheckPoses => {
            Body::Json(json!({"body": ball(), "configurations": [[0, 0, 0, 0, 0, 0, 1]]}))
        }
        Operation::CheckSpheres => Body::Json(json!({"spheres": [[0, 0, 0, 0.1]]})),
        Operation::CheckMotions => {
            let pose = [0, 0, 0, 0, 0, 0, 1];
            Body::Json(json!({"body": ball(), "configurations": [pose, pose], "lengths": [2]}))
        }
        Operation::CastRays => Body::Json(json!({"origins": row(1), "directions": [[1, 0, 0]]})),
        Operation::FindNearest => Body::Json(json!({"points": row(1), "radius_m": 1})),
        Operation::ClassifyPoints => Body::Json(json!({"points": row(1)})),
        Operation::ListFrontiers => Body::Json(json!({"box": {"min_m": [0, 0, 0], "max_m": [1, 1, 1]}})),
        Operation::ProjectGrid | Operation::StreamGrid => Body::Json(json!({})),
        Operation::Undo => Body::Json(json!({"revision": 1})),
        Operation::PutKeepOut => Body::Json(json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}})),
        Operation::CreateMap => Body::Json(json!({"resolution_m": 0.1})),
        Operation::RenameMap => Body::Json(json!({"to": "renamed"})),
        Operation::RestoreMap => Body::File,
        Operation::ListMaps
        | Operation::GetMap
        | Operation::DeleteMap
        | Operation::ListVoxels
        | Operation::ListKeepOuts
        | Operation::DeleteKeepOut
        | Operation::GetBlock
        | Operation::ListObservers
        | Operation::Watch
        | Operation::ListEvents
        | Operation::WatchEvents
        | Operation::GetTrajectory
        | Operation::StreamTrajectory
        | Operation::SnapshotMap
        | Operation::QueryPointsStream
        | Operation::CheckPosesStream
        | Operation::CheckSpheresStream
        | Operation::CheckMotionsStream
        | Operation::CastRaysStream
        | Operation::FindNearestStream
        | Operation::ClassifyPointsStream
        | Operation::InsertScanStream
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
        | Operation::ReadApiFile => Body::None,
    }
}

/// Every route, with its method and its path on map `a`.
fn routes() -> impl Iterator<Item = (Operation, Method, String)> {
    Operation::ALL.iter().filter_map(|&operation| {
        let Route { method, path } = operation.route()?;
        let path = path
            .replace("{map}", "a")
            .replace("{name}", "dock")
            .replace("{file}", "main.js")
            .replace("{asset}", "start.js");
        Some((operation, method.parse().unwrap(), path))
    })
}

/// What came of a request with a body of this kind.
async fn ask(
    daemon: &Daemon,
    (method, path): (&Method, &str),
    kind: &str,
    body: Vec<u8>,
) -> (StatusCode, Value) {
    let request = client().request(method.clone(), daemon.url(path)).header("content-type", kind);
    refused(request.body(body).send().await.unwrap()).await
}

const JSON: &str = "application/json";
const BYTES: &str = "application/octet-stream";

/// Words that only who reads the source can know.
#[track_caller]
fn assert_no_rust(error: &Value) {
    let message = error["detail"].as_str().unwrap();
    for word in [
        "struct",
        "enum",
        "variant",
        "Json",
        "Query",
        "Parameters",
        "In ",
        "u32",
        "u64",
        "f64",
        "sequence",
        "tuple",
    ] {
        assert!(!message.contains(word), "{word:?} is in {message:?}");
    }
}

#[tokio::test]
async fn a_parameter_that_a_route_does_not_take_is_refused_by_its_name() {
    let daemon = daemon().await;
    for (operation, method, path) in routes() {
        let answers = match body(operation) {
            Body::None => {
                let path = format!("{path}?dry_run=true");
                vec![refused(client().request(method, daemon.url(&path)).send().await.unwrap()).await]
            }
            Body::Json(json) => {
                let path = format!("{path}?dry_run=true");
                vec![ask(&daemon, (&method, &path), JSON, json.to_string().into()).await]
            }
            Body::File => {
                let path = format!("{path}?dry_run=true");
                vec![ask(&daemon, (&method, &path), BYTES, b"no map".to_vec()).await]
            }
            Body::Points(json, rest) => {
                let (as_json, as_bytes) =
                    (format!("{path}?dry_run=true"), format!("{path}?{rest}dry_run=true"));
                vec![
                    ask(&daemon, (&method, &as_json), JSON, json.to_string().into()).await,
                    ask(&daemon, (&method, &as_bytes), BYTES, bytes_of(&row(1))).await,
                ]
            }
        };
        for (status, error) in answers {
            assert_eq!(status, StatusCode::BAD_REQUEST, "{operation:?}: {error}");
            assert_no_rust(&error);
            assert_refused((status, error), &["dry_run"]);
        }
    }
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn an_array_does_not_pass_for_an_object() {
    let daemon = daemon().await;
    for (operation, method, path) in routes() {
        let (Body::Json(good) | Body::Points(good, _)) = body(operation) else { continue };
        // The values in the order of the fields, as a decoder that takes arrays for structures would have them.
        let values: Vec<Value> = good.as_object().unwrap().values().cloned().collect();
        for array in [json!([]), json!(["r", null, row(1)]), json!([row(1)]), json!([0.2]), json!(values)] {
            let (status, error) = ask(&daemon, (&method, &path), JSON, array.to_string().into()).await;
            assert_eq!(status, StatusCode::BAD_REQUEST, "{operation:?} takes {array}: {error}");
            assert_no_rust(&error);
            assert_refused((status, error), &["object", "array"]);
        }
    }
    let pose = json!([[0, 0, 0], [0, 0, 0, 1]]);
    for (route, body, field) in [
        ("occupancy", json!({"points": row(1), "map_from_points": pose}), "map_from_points"),
        ("scans", json!({"robot": "r", "points": row(1), "guess": pose}), "guess"),
        ("scans", json!({"robot": "r", "points": row(1), "motion": pose}), "motion"),
        ("alignment", json!({"robot": "r", "points": row(1), "guess": pose}), "guess"),
        ("deletions", json!({"box": [[0, 0, 0], [1, 1, 1]]}), "box"),
        ("deletions", json!({"sphere": [[0, 0, 0], 1]}), "sphere"),
        ("localize", json!({"points": row(1), "gravity": [[0, 0, -1], null]}), "gravity"),
        ("localize", json!({"points": row(1), "search_box": [[0, 0, 0], [1, 1, 1]]}), "search_box"),
    ] {
        let answer = refused(daemon.post(&format!("/v1/maps/a/{route}"), body).await).await;
        assert_no_rust(&answer.1);
        assert_refused(answer, &[field, "object", "array"]);
    }
    let filter = json!({"resolution_m": 0.1, "filter": [3, 16]});
    assert_refused(refused(daemon.put("/v1/maps/b", filter).await).await, &["filter", "object", "array"]);
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn garbage_is_refused_by_every_route_without_a_word_of_rust() {
    let daemon = daemon().await;
    for (operation, method, path) in routes() {
        let bodies: [&[u8]; 7] =
            [b"", b"null", b"7", b"\"text\"", b"{", b"{\"a\": {}}", &[0xff, 0xfe, 0x00, 0x01, 0x02]];
        for garbage in bodies {
            let kind = match body(operation) {
                Body::None => continue,
                Body::Json(_) | Body::Points(..) => JSON,
                Body::File => BYTES,
            };
            let (status, error) = ask(&daemon, (&method, &path), kind, garbage.to_vec()).await;
            assert!(status.is_client_error(), "{operation:?} {garbage:?}: {status} {error}");
            assert_no_rust(&error);
        }
    }
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn a_value_of_the_wrong_kind_is_named_by_its_field_and_what_belongs_there() {
    let daemon = daemon().await;
    for (route, body, words) in [
        ("occupancy", json!({"points": row(1), "level": "x"}), ["level", "whole number"]),
        ("occupancy", json!({"points": row(1), "level": -1}), ["level", "whole number"]),
        ("occupancy", json!({"points": row(1), "min_revision": 1.5}), ["min_revision", "whole number"]),
        ("occupancy", json!({"points": row(1), "lookup": "maybe"}), ["lookup", "exact"]),
        ("occupancy", json!({"points": [[1, 2, 3], [1, 2, "x"]]}), ["points[1][2]", "number"]),
        ("occupancy", json!({"points": {"x": 1}}), ["points", "array"]),
        ("scans", json!({"robot": 7, "points": row(1)}), ["robot", "string"]),
        ("scans", json!({"robot": "r", "points": row(1), "method": "best"}), ["method", "refined"]),
        ("scans", json!({"robot": "r", "points": row(1), "align": "no"}), ["align", "true or false"]),
        ("deletions", json!({"box": {"min_m": [0, 0, 0]}}), ["box", "max_m"]),
        ("deletions", json!({"sphere": {"center_m": [0, 0], "radius_m": 1}}), ["sphere.center_m", "3"]),
        ("undo", json!({"revision": "last"}), ["revision", "whole number"]),
    ] {
        let answer = refused(daemon.post(&format!("/v1/maps/a/{route}"), body).await).await;
        assert_no_rust(&answer.1);
        assert_refused(answer, &words);
    }
    for (parameters, words) in [
        ("level=x", ["level", "whole number"]),
        ("level=99999999999", ["level", "too large"]),
        ("lookup=maybe", ["lookup", "exact"]),
    ] {
        let route = format!("/v1/maps/a/occupancy?{parameters}");
        let answer = refused(daemon.post_bytes(&route, bytes_of(&row(1))).await).await;
        assert_no_rust(&answer.1);
        assert_refused(answer, &words);
    }
    let align = daemon.post_bytes("/v1/maps/a/scans?robot=r&align=no", bytes_of(&row(1))).await;
    assert_refused(refused(align).await, &["align", "true or false"]);
    let listed = json_of(daemon.get("/v1/maps").await).await;
    assert_eq!(listed["maps"].as_array().map(Vec::len), Some(1));
    assert_unchanged(&daemon).await;
}
