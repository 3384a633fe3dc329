//! Any operation asked for, in either protocol, and whether the caller was let in.

use bytes::{Buf, BufMut};
use mrol::access::{Operation, Route, Secret};
use mrol::wire::pb;
use prost::Message;
use reqwest::StatusCode;
use reqwest::header::WWW_AUTHENTICATE;
use serde_json::Value;
use tonic::client::Grpc;
use tonic::codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder};
use tonic::codegen::http::uri::PathAndQuery;
use tonic::transport::Channel;
use tonic::{Code, Request, Status};

use super::keyring::Guarded;
use super::requests::{body, message};

/// What came of asking.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The service answered, whatever it said.
    LetIn,
    /// There is no key, or none that is known.
    Unknown { reason: String },
    /// The key is for something else.
    Denied { reason: String, message: String },
}

/// Asks over HTTP.
pub(crate) async fn over_http(
    server: &Guarded,
    operation: Operation,
    route: Route,
    map: &str,
    key: Option<&Secret>,
) -> Outcome {
    let path = route
        .path
        .replace("{map}", map)
        .replace("{name}", "dock")
        .replace("{file}", "main.js")
        .replace("{asset}", "start.js");
    let method = route.method.parse().unwrap();
    let answer = server.http(method, &path, key, body(operation)).await;
    let status = answer.status();
    let challenge = answer.headers().get(WWW_AUTHENTICATE).map(|challenge| challenge.to_str().unwrap());
    let expected = if key.is_some() {
        r#"Bearer realm="mrol", error="invalid_token""#
    } else {
        r#"Bearer realm="mrol""#
    };
    assert_eq!(challenge, (status == StatusCode::UNAUTHORIZED).then_some(expected), "{operation:?}");
    // What was let in may answer for as long as somebody reads.
    let error: Value =
        if status.is_success() { Value::Null } else { answer.json().await.unwrap_or_default() };
    let text = |field: &str| error[field].as_str().unwrap_or_default().to_owned();
    match status {
        StatusCode::UNAUTHORIZED => Outcome::Unknown { reason: text("reason") },
        StatusCode::FORBIDDEN => Outcome::Denied { reason: text("reason"), message: text("detail") },
        StatusCode::METHOD_NOT_ALLOWED => panic!("{operation:?} is not served"),
        _ if status.is_server_error() || text("reason") == "route_not_found" => {
            panic!("{operation:?} is not served: {status} {error}")
        }
        _ => Outcome::LetIn,
    }
}

/// Asks over gRPC.
pub(crate) async fn over_grpc(
    channel: Channel,
    operation: Operation,
    call: &'static str,
    map: &str,
    key: Option<&Secret>,
) -> Outcome {
    match first_answer(channel, call, message(operation, map), key).await {
        Ok(_) => Outcome::LetIn,
        Err(status) => {
            let reason = status.metadata().get("mrol-reason").map(|word| word.to_str().unwrap().to_owned());
            let reason = reason.unwrap_or_default();
            match status.code() {
                Code::Unauthenticated => Outcome::Unknown { reason },
                Code::PermissionDenied => Outcome::Denied { reason, message: status.message().into() },
                Code::Unimplemented | Code::Internal | Code::Unknown => panic!("{operation:?}: {status}"),
                _ => Outcome::LetIn,
            }
        }
    }
}

/// Sends a message, as unary calls and streams do alike, and waits for the first answer.
pub(crate) async fn first_answer(
    channel: Channel,
    call: &'static str,
    message: Vec<u8>,
    key: Option<&Secret>,
) -> Result<Option<Vec<u8>>, Status> {
    let mut request = Request::new(tokio_stream::once(message));
    if let Some(key) = key {
        request.metadata_mut().insert("authorization", format!("Bearer {}", key.reveal()).parse().unwrap());
    }
    let mut grpc = Grpc::new(channel);
    grpc.ready().await.unwrap();
    let answers = grpc.streaming(request, PathAndQuery::from_static(call), Bytewise).await?;
    let answer = answers.into_inner().message().await?;
    match answer.as_deref().filter(|_| call.ends_with("/InsertScanStream")).and_then(failure) {
        Some(failure) => Err(failure),
        None => Ok(answer),
    }
}

/// The status of a scan that failed in a stream of scans, which goes on.
fn failure(answer: &[u8]) -> Option<Status> {
    let failure = pb::InsertScanResponse::decode(answer).unwrap().error?;
    let mut status = Status::new(Code::from_i32(failure.code), failure.message);
    status.metadata_mut().insert("mrol-reason", failure.reason.parse().unwrap());
    Some(status)
}

/// Messages as the bytes that they are.
#[derive(Debug, Clone, Copy)]
struct Bytewise;

impl Codec for Bytewise {
    type Encode = Vec<u8>;
    type Decode = Vec<u8>;
    type Encoder = Self;
    type Decoder = Self;

    fn encoder(&mut self) -> Self {
        Self
    }

    fn decoder(&mut self) -> Self {
        Self
    }
}

impl Encoder for Bytewise {
    type Item = Vec<u8>;
    type Error = Status;

    fn encode(&mut self, item: Vec<u8>, bytes: &mut EncodeBuf<'_>) -> Result<(), Status> {
        bytes.put_slice(&item);
        Ok(())
    }
}

impl Decoder for Bytewise {
    type Item = Vec<u8>;
    type Error = Status;

    fn decode(&mut self, bytes: &mut DecodeBuf<'_>) -> Result<Option<Vec<u8>>, Status> {
        let mut item = vec![0; bytes.remaining()];
        bytes.copy_to_slice(&mut item);
        Ok(Some(item))
    }
}
