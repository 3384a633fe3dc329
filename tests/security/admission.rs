//! Every limit on what is let in refuses by its name, and what is refused keeps nobody else out.

use std::time::Duration;

use mrol::config::Config;
use mrol::wire::pb;
use mrol::wire::pb::occupancy_client::OccupancyClient;
use reqwest::{Response, StatusCode};
use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_stream::StreamExt;
use tonic::Code;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_client::HealthClient;

use crate::support::daemon::{Daemon, PATIENCE, bytes_of, client, json_of, query_pb, row, wait_until};

const MIB: usize = 1 << 20;

async fn daemon(change: impl FnOnce(&mut Config)) -> Daemon {
    let daemon = Daemon::start_with(change).await;
    daemon.make_map("a").await;
    daemon
}

/// What is asked for by a request that waits for ten seconds, unless it is given up.
fn waiting() -> serde_json::Value {
    json!({"points": row(1), "min_revision": 9})
}

async fn assert_shed(answer: Response, limit: &str) {
    assert_eq!(answer.status(), StatusCode::TOO_MANY_REQUESTS);
    let wait: u64 = answer.headers()["retry-after"].to_str().expect("text").parse().expect("seconds");
    assert!(wait >= 1);
    let error = json_of(answer).await;
    assert_eq!(
        (error["code"].as_str(), error["reason"].as_str()),
        (Some("resource_exhausted"), Some("overloaded"))
    );
    let message = error["detail"].as_str().expect("a message");
    assert!(message.contains(limit), "{message}");
}

async fn assert_probes_answer(daemon: &Daemon) {
    for probe in ["/livez", "/readyz", "/metrics"] {
        assert_eq!(daemon.get(probe).await.status(), StatusCode::OK, "{probe}");
    }
    let mut health = HealthClient::new(daemon.channel().await);
    assert_eq!(health.check(HealthCheckRequest::default()).await.expect("health").into_inner().status, 1);
}

/// A request over HTTP/1 of which the head and some of the body is sent.
async fn begun(daemon: &Daemon, declared: usize, sent: usize) -> TcpStream {
    let mut connection = TcpStream::connect(daemon.http).await.expect("a connection");
    let head = format!(
        "POST /v1/maps/a/occupancy HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/octet-stream\r\n\
         content-length: {declared}\r\n\r\n"
    );
    connection.write_all(head.as_bytes()).await.expect("a head");
    connection.write_all(&vec![0; sent]).await.expect("some of a body");
    connection
}

/// What comes until the connection is closed.
async fn rest_of(mut connection: TcpStream) -> String {
    let mut answer = Vec::new();
    let read = tokio::time::timeout(PATIENCE, connection.read_to_end(&mut answer)).await;
    read.expect("an end").expect("bytes");
    String::from_utf8_lossy(&answer).into_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn more_requests_than_requests_max_are_shed_and_probes_are_not() {
    let daemon = daemon(|config| config.limits.requests_max = 2).await;
    let post = client().post(daemon.url("/v1/maps/a/occupancy")).json(&waiting());
    let busy: Vec<_> = (0..2).map(|_| tokio::spawn(post.try_clone().expect("a request").send())).collect();
    // Only a probe takes nobody's place meanwhile.
    wait_until(async || daemon.metric(r#"mrol_requests_in_flight{state="in_work"}"#).await == Some(2.0))
        .await;

    assert_shed(daemon.get("/v1/maps/a").await, "requests_max is 2").await;
    assert_shed(daemon.post("/v1/maps/a/occupancy", json!({"points": row(1)})).await, "requests_max is 2")
        .await;
    let refused = daemon.occupancy().await.query_points(query_pb("a", &row(1))).await.expect_err("a refusal");
    assert_eq!(refused.code(), Code::ResourceExhausted);
    assert!(refused.message().contains("requests_max is 2"), "{refused:?}");
    assert_eq!(refused.metadata().get("grpc-retry-pushback-ms").expect("a wait"), "1000");
    assert_probes_answer(&daemon).await;

    // Whose callers have gone is over.
    busy.iter().for_each(tokio::task::JoinHandle::abort);
    wait_until(async || daemon.get("/v1/maps/a").await.status() == StatusCode::OK).await;
}

#[tokio::test]
async fn more_streams_than_streams_max_are_shed() {
    let daemon = daemon(|config| config.limits.streams_max = 2).await;
    let mut open = Vec::new();
    for _ in 0..2 {
        let (send, requests) = tokio::sync::mpsc::channel(1);
        send.send(query_pb("a", &row(1))).await.expect("a stream");
        let requests = tokio_stream::wrappers::ReceiverStream::new(requests);
        let mut answers =
            daemon.occupancy().await.query_points_stream(requests).await.expect("a stream").into_inner();
        answers.message().await.expect("an answer").expect("an answer");
        open.push((send, answers));
    }
    let third = tokio_stream::once(query_pb("a", &row(1)));
    let refused = daemon.occupancy().await.query_points_stream(third).await.expect_err("a refusal");
    assert_eq!(refused.code(), Code::ResourceExhausted);
    assert!(refused.message().contains("streams_max is 2"), "{refused:?}");
    // Requests and health are no streams.
    daemon.occupancy().await.query_points(query_pb("a", &row(1))).await.expect("an answer");
    assert_probes_answer(&daemon).await;

    drop(open);
    wait_until(async || {
        let again = tokio_stream::once(query_pb("a", &row(1)));
        daemon.occupancy().await.query_points_stream(again).await.is_ok()
    })
    .await;
}

#[tokio::test]
async fn answers_of_a_stream_count_until_they_are_read() {
    let daemon = daemon(|_| {}).await;
    let server =
        tonic::transport::Endpoint::from_shared(format!("http://{}", daemon.grpc)).expect("an address");
    // With room for a byte of the answers.
    let channel = server.initial_stream_window_size(1).connect().await.expect("a connection");
    let questions = vec![query_pb("a", &vec![[0.05; 3]; 200_000]); 6];
    let mut planner = OccupancyClient::new(channel);
    let unread = planner.query_points_stream(tokio_stream::iter(questions)).await.expect("a stream");
    let answered = r#"mrol_requests_total{protocol="grpc",operation="QueryPointsStream",code="ok"}"#;
    wait_until(async || daemon.metric(answered).await == Some(6.0)).await;
    // Two or three are on their way in one piece, and count as one; gauges are read every second.
    let counted = 4.0 * 25_000.0..7.0 * 25_000.0;
    wait_until(async || daemon.metric("mrol_body_bytes").await.is_some_and(|bytes| counted.contains(&bytes)))
        .await;
    drop(unread);
    wait_until(async || daemon.metric("mrol_body_bytes").await == Some(0.0)).await;
}

#[tokio::test]
async fn bodies_share_a_budget_that_declared_lengths_do_not_count_in() {
    let daemon = daemon(|config| {
        config.limits.message_bytes_max = MIB;
        config.limits.body_bytes_max = 3 * MIB / 2;
        // The machine may be slow.
        config.limits.body_bytes_per_s_min = 10;
    })
    .await;
    let points = vec![[0.05; 3]; 80_000];
    let ask = async || daemon.post_bytes("/v1/maps/a/occupancy", bytes_of(&points)).await;
    let mut declared = Vec::new();
    for _ in 0..20 {
        declared.push(begun(&daemon, MIB, 0).await);
    }
    assert_eq!(ask().await.status(), StatusCode::OK);

    // One that is being sent keeps its memory.
    let mut sending = begun(&daemon, MIB, 900_000).await;
    wait_until(async || daemon.metric("mrol_body_bytes").await >= Some(900_000.0)).await;
    sending.write_all(&[0; 100]).await.expect("more");
    assert_shed(ask().await, "body_bytes_max is 1572864").await;
    // One that is silent gives way.
    wait_until(async || ask().await.status() == StatusCode::OK).await;
    let answer = rest_of(sending).await;
    assert!(answer.starts_with("HTTP/1.1 429") && answer.contains("body_bytes_max is 1572864"), "{answer}");
}

#[tokio::test]
async fn what_a_compressed_message_grows_to_counts() {
    let daemon = daemon(|config| {
        config.limits.message_bytes_max = MIB;
        config.limits.body_bytes_max = MIB;
    })
    .await;
    // A kilobyte or so on the way.
    let large = || query_pb("a", &vec![[0.05; 3]; 80_000]);
    let compressed =
        || async { daemon.occupancy().await.send_compressed(tonic::codec::CompressionEncoding::Zstd) };
    compressed().await.query_points(large()).await.expect("room for one");
    let held = pb::QueryPointsRequest { min_revision: Some(9), ..large() };
    let mut planner = compressed().await;
    let held = tokio::spawn(async move { planner.query_points(held).await });
    wait_until(async || daemon.metric("mrol_body_bytes").await >= Some(960_000.0)).await;
    for refused in [
        compressed().await.query_points(large()).await.expect_err("a refusal"),
        first_of_stream(compressed().await, large()).await.expect_err("a refusal"),
    ] {
        assert_eq!(refused.code(), Code::ResourceExhausted);
        assert!(refused.message().contains("body_bytes_max is 1048576"), "{refused:?}");
    }
    held.abort();
    wait_until(async || first_of_stream(compressed().await, large()).await.is_ok()).await;

    // A bomb is refused where it goes off.
    let bomb = query_pb("a", &vec![[0.05; 3]; 200_000]);
    let refused = compressed()
        .await
        .max_encoding_message_size(64 * MIB)
        .query_points(bomb)
        .await
        .expect_err("a refusal");
    assert_eq!(refused.code(), Code::ResourceExhausted);
    assert!(refused.message().contains("message_bytes_max is 1048576"), "{refused:?}");
}

async fn first_of_stream(
    mut planner: pb::occupancy_client::OccupancyClient<tonic::transport::Channel>,
    request: pb::QueryPointsRequest,
) -> Result<pb::QueryPointsResponse, tonic::Status> {
    let mut answers = planner.query_points_stream(tokio_stream::once(request)).await?.into_inner();
    Ok(answers.message().await?.expect("an answer"))
}

#[tokio::test]
async fn a_body_that_falls_silent_is_ended() {
    let daemon = daemon(|config| config.limits.body_silence_max_s = 0.5).await;
    let answer = rest_of(begun(&daemon, 1000, 500).await).await;
    assert!(answer.starts_with("HTTP/1.1 408") && answer.contains("body_silence_max is 500ms"), "{answer}");

    // A stream may be silent between two messages.
    let (send, requests) = tokio::sync::mpsc::channel(1);
    let requests = tokio_stream::wrappers::ReceiverStream::new(requests);
    let mut answers =
        daemon.occupancy().await.query_points_stream(requests).await.expect("a stream").into_inner();
    for _ in 0..2 {
        send.send(query_pb("a", &row(1))).await.expect("a stream");
        answers.message().await.expect("an answer").expect("an answer");
        tokio::time::sleep(Duration::from_millis(2500)).await;
    }
}

#[tokio::test]
async fn a_caller_that_asks_too_often_is_told_when_to_come_again() {
    let daemon = daemon(|config| {
        config.limits.caller_requests_per_s_max = 1;
        config.limits.caller_burst_max = 3;
    })
    .await;
    let limit = "caller_requests_per_s_max is 1";
    // The map was the first request.
    for _ in 0..2 {
        assert_eq!(daemon.get("/v1/maps/a").await.status(), StatusCode::OK);
    }
    assert_shed(daemon.get("/v1/maps/a").await, limit).await;
    let refused = daemon.occupancy().await.query_points(query_pb("a", &row(1))).await.expect_err("a refusal");
    assert!(refused.message().contains(limit), "{refused:?}");
    for _ in 0..10 {
        assert_eq!(daemon.get("/livez").await.status(), StatusCode::OK);
    }
    // Messages of a stream are requests.
    wait_until(async || {
        let many = tokio_stream::iter(vec![query_pb("a", &row(1)); 5]);
        let Ok(answers) = daemon.occupancy().await.query_points_stream(many).await else { return false };
        let answers: Vec<_> = answers.into_inner().collect().await;
        answers.last().expect("an answer").as_ref().is_err_and(|status| status.message().contains(limit))
    })
    .await;
}

#[tokio::test]
async fn idle_connections_give_way_to_new_ones() {
    let daemon = daemon(|config| {
        config.limits.requests_max = 1;
        config.limits.streams_max = 1;
        config.limits.watches_max = 0;
        config.limits.connections_max = 4;
    })
    .await;
    let mut idle = Vec::new();
    for address in [daemon.http, daemon.grpc].into_iter().cycle().take(16) {
        idle.push(TcpStream::connect(address).await.expect("a connection"));
        assert_eq!(daemon.get("/livez").await.status(), StatusCode::OK);
        // Who has just come keeps its place for a moment.
        wait_until(async || daemon.occupancy().await.query_points(query_pb("a", &row(1))).await.is_ok())
            .await;
    }
    let first = rest_of(idle.swap_remove(0)).await;
    assert_eq!(first, "");
}

#[tokio::test]
async fn who_does_not_begin_to_speak_is_disconnected() {
    let daemon = daemon(|config| {
        config.limits.connection_opening_max_s = 0.5;
        config.limits.http_idle_max_s = 1.0;
        config.limits.grpc_idle_max_s = 1.0;
    })
    .await;
    let said = async |address, words: &[u8]| {
        let mut connection = TcpStream::connect(address).await.expect("a connection");
        connection.write_all(words).await.expect("words");
        rest_of(connection).await
    };
    assert_eq!(said(daemon.http, b"").await, "");
    assert_eq!(said(daemon.http, b"PRI * HT").await, "");
    // Its own settings may have been sent.
    said(daemon.grpc, b"PRI * HT").await;
    // Headers that do not end, and a connection that is kept open for nothing.
    said(daemon.http, b"GET /livez HTTP/1.1\r\nhost: localhost\r\nx-slow: ").await;
    let answer = said(daemon.http, b"GET /livez HTTP/1.1\r\nhost: localhost\r\n\r\n").await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    // A client reconnects where its connection was closed for idleness.
    let mut planner = daemon.occupancy().await;
    for _ in 0..2 {
        planner.query_points(query_pb("a", &row(1))).await.expect("an answer");
        tokio::time::sleep(Duration::from_millis(2500)).await;
    }
}

#[tokio::test]
async fn limits_that_contradict_each_other_are_refused() {
    let refusal = |variables: serde_json::Value| {
        Config::load(None, json!({ "limits": variables })).expect_err("a refusal").to_string()
    };
    assert!(refusal(json!({"requests_max": 0})).contains("limits.requests_max must be 1 to 1048576, got 0"));
    let connections = refusal(json!({"requests_max": 1000}));
    assert!(connections.contains("limits.connections_max must be more than twice"), "{connections}");
    let bytes = refusal(json!({"body_bytes_max": 1000}));
    assert!(bytes.contains("limits.body_bytes_max must be at least limits.message_bytes_max"), "{bytes}");
}
