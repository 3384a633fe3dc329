//! Refusals come before work: no body is waited for, no file is gathered.

use mrol::access::{Operation, Scope, Secret};
use mrol::wire::pb;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tonic::{Code, Request};

use super::asking::first_answer;
use super::keyring::Guarded;
use crate::support::daemon::PATIENCE;

/// The first bytes of the answer to a request that promises a body and sends none.
async fn answer_without_body(server: &Guarded, path: &str, key: Option<&Secret>) -> String {
    let authorization =
        key.map(|key| format!("authorization: Bearer {}\r\n", key.reveal())).unwrap_or_default();
    let head = format!(
        "POST {path} HTTP/1.1\r\nhost: localhost\r\n{authorization}content-type: application/json\r\n\
         content-length: 1000000\r\n\r\n"
    );
    let mut connection = TcpStream::connect(server.daemon.http).await.unwrap();
    connection.write_all(head.as_bytes()).await.unwrap();
    let mut answer = vec![0; 1000];
    let read =
        tokio::time::timeout(PATIENCE, connection.read(&mut answer)).await.expect("an answer").unwrap();
    String::from_utf8_lossy(&answer[..read]).into_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_is_refused_before_its_body() {
    let keys = |keyring: &super::keyring::Keyring| {
        [("reader", Scope::Read, None), ("own", Scope::Write, Some(&["own"][..]))]
            .map(|(name, scope, maps)| keyring.add(name, scope, maps))
    };
    let (server, [reader, own]) = Guarded::start_with(keys).await;
    let refused = async |key| answer_without_body(&server, "/v1/maps/other/scans", key).await;
    assert!(refused(None).await.starts_with("HTTP/1.1 401 "));
    assert!(refused(Some(&reader)).await.starts_with("HTTP/1.1 403 "));
    assert!(refused(Some(&own)).await.starts_with("HTTP/1.1 403 "));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_file_is_refused_with_its_first_piece() {
    let (server, key) = Guarded::start_with(|keys| keys.add("own", Scope::Admin, Some(&["own"]))).await;
    let (send, pieces) = tokio::sync::mpsc::channel(1);
    let first =
        pb::RestoreMapRequest { map: "other".into(), data: b"the first of many"[..].into(), replace: false };
    send.send(first).await.unwrap();
    let mut request = Request::new(tokio_stream::wrappers::ReceiverStream::new(pieces));
    request.metadata_mut().insert("authorization", format!("Bearer {}", key.reveal()).parse().unwrap());
    // The sender stays: more could come for ever.
    let refused =
        tokio::time::timeout(PATIENCE, async { server.daemon.maps().await.restore_map(request).await });
    assert_eq!(refused.await.expect("an answer").unwrap_err().code(), Code::PermissionDenied);
    drop(send);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_call_that_is_none_reaches_no_service() {
    let (server, ()) = Guarded::start_with(|_| ()).await;
    let known = Operation::GetMap.grpc().unwrap();
    for call in ["/mrol.v1.Maps/Nothing", "/mrol.v2.Maps/GetMap", "/mrol.v1.Maps/getmap"] {
        assert_ne!(call, known);
        let refused =
            first_answer(server.daemon.channel().await, call, Vec::new(), Some(&server.master)).await;
        assert_eq!(refused.unwrap_err().code(), Code::Unimplemented, "{call}");
    }
}
