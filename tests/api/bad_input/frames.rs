//! gRPC bodies that hold no message: the client is told so, and nothing is called a defect of the server.

use http_body_util::{BodyExt, Full};
use mrol::access::Operation;
use tonic::body::Body;
use tonic::codegen::http::{HeaderMap, Request};
use tonic::transport::Channel;
use tower::ServiceExt;

use super::{assert_unchanged, daemon};

/// A message as gRPC frames it: not compressed, its length, its bytes.
fn frame(message: &[u8]) -> Vec<u8> {
    [&[0][..], &(message.len() as u32).to_be_bytes(), message].concat()
}

/// Bodies that no call can read, by what is wrong with them.
fn garbage() -> Vec<(&'static str, Vec<u8>)> {
    let mut cut = frame(&[10, 1, b'a', 10, 1, b'a']);
    cut.truncate(8);
    vec![
        ("no protobuf", frame(&[0xff; 11])),
        ("a field of the wrong kind", frame(&[0x08, 1])),
        ("a length beyond the end", frame(&[0x0a, 200])),
        ("a length beyond all memory", frame(&[0x0a, 0xff, 0xff, 0xff, 0xff, 0x7f])),
        ("a name that is no text", frame(&[0x0a, 2, 0xff, 0xfe])),
        ("a frame that ends early", cut),
        ("half a frame's head", vec![0, 0, 0]),
        ("a flag that is none", [&[7][..], &frame(&[])[1..]].concat()),
        ("compressed, and nobody said how", [&[1][..], &frame(&[])[1..]].concat()),
    ]
}

/// Code, reason and message of the status that answers a call with this body.
async fn answer(channel: Channel, call: &str, body: Vec<u8>) -> (String, String, String) {
    let request = Request::post(call).header("content-type", "application/grpc").header("te", "trailers");
    let request = request.body(Body::new(Full::from(body))).unwrap();
    let answer = channel.oneshot(request).await.unwrap();
    let headers = answer.headers().clone();
    let trailers = answer.into_body().collect().await.unwrap().trailers().cloned().unwrap_or_default();
    let text = |all: &HeaderMap, name| all.get(name).map(|value| value.to_str().unwrap().to_owned());
    let of = |name| text(&headers, name).or_else(|| text(&trailers, name)).unwrap_or_default();
    (of("grpc-status"), of("mrol-reason"), of("grpc-message"))
}

/// Calls whose message has no field at all, so that any bytes of the wire format are one.
fn takes_anything(operation: Operation) -> bool {
    operation == Operation::ListMaps
}

#[tokio::test]
async fn what_holds_no_message_is_the_clients_mistake_in_every_call() {
    let daemon = daemon().await;
    let channel = daemon.channel().await;
    for &operation in Operation::ALL {
        // Reflection is answered by tonic's own service, which ends such a stream without a word.
        let Some(call) = operation.grpc().filter(|_| operation != Operation::Reflect) else { continue };
        for (what, body) in garbage() {
            let any = takes_anything(operation) && what != "no protobuf" && body.len() > 5 && body[0] == 0;
            if any && what != "a frame that ends early" {
                continue;
            }
            let (code, reason, message) = answer(channel.clone(), call, body).await;
            assert_eq!((&*code, &*reason), ("3", "bad_message"), "{operation:?}, {what}: {message}");
            assert!(!message.contains("pb::"), "{operation:?}, {what}: {message}");
        }
        if !operation.is_stream() && operation != Operation::RestoreMap {
            let (code, reason, message) = answer(channel.clone(), call, Vec::new()).await;
            assert_eq!((&*code, &*reason), ("3", "bad_message"), "{operation:?}, nothing: {message}");
        }
    }
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn packed_numbers_of_a_wrong_length_are_named_with_their_field() {
    let daemon = daemon().await;
    let field = |number: u8, bytes: &[u8]| [&[number << 3 | 2, bytes.len() as u8][..], bytes].concat();
    // QueryPointsRequest { map, points: Points { xyz } }, where the numbers are not of four bytes each.
    for bytes in [1, 5, 7] {
        let points = field(2, &field(2, &vec![0; bytes]));
        let message = frame(&[field(1, b"a"), points].concat());
        let channel = daemon.channel().await;
        let (code, reason, said) = answer(channel, "/mrol.v1.Occupancy/QueryPoints", message).await;
        assert_eq!((&*code, &*reason), ("3", "bad_message"), "{bytes}: {said}");
        assert!(said.contains("xyz"), "{bytes}: {said}");
    }
    assert_unchanged(&daemon).await;
}

#[tokio::test]
async fn numbers_that_are_no_value_of_an_enum_are_named() {
    use mrol::wire::pb;
    let daemon = daemon().await;
    let mut robot = daemon.mapping().await;
    let scan = pb::InsertScanRequest {
        method: 77,
        ..crate::support::daemon::scan_pb("a", "r", &crate::support::daemon::row(1))
    };
    super::assert_invalid(&robot.insert_scan(scan).await.unwrap_err(), &["method", "77"]);
    let query = pb::QueryPointsRequest {
        lookup: -1,
        ..crate::support::daemon::query_pb("a", &crate::support::daemon::row(1))
    };
    let refused = daemon.occupancy().await.query_points(query).await.unwrap_err();
    super::assert_invalid(&refused, &["lookup", "-1"]);
    assert_unchanged(&daemon).await;
}
