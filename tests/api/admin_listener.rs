//! Health and metrics at an address of their own.

use std::net::SocketAddr;
use std::time::Duration;

use mrol::config::Config;
use reqwest::StatusCode;
use serde_json::Value;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;

use crate::support::daemon::{Daemon, client, wait_until};

fn with_admin(config: &mut Config) {
    config.admin.listen = Some(([127, 0, 0, 1], 0).into());
}

async fn status(admin: SocketAddr, path: &str) -> StatusCode {
    client().get(format!("http://{admin}{path}")).send().await.unwrap().status()
}

#[tokio::test(flavor = "multi_thread")]
async fn it_tells_health_and_metrics_and_serves_nothing_else() {
    let daemon = Daemon::start_with(with_admin).await;
    daemon.make_map("a").await;
    let admin = daemon.admin.unwrap();
    for path in ["/livez", "/readyz", "/metrics"] {
        wait_until(async || status(admin, path).await == StatusCode::OK).await;
    }
    for path in ["/v1/maps", "/v1/maps/a", "/", "/docs", "/openapi.json", "/viewer/main.js"] {
        assert_eq!(status(admin, path).await, StatusCode::NOT_FOUND, "{path}");
    }
    let posted = client().post(format!("http://{admin}/livez")).send().await.unwrap();
    assert_eq!(posted.status(), StatusCode::METHOD_NOT_ALLOWED);
    let metrics = client().get(format!("http://{admin}/metrics")).send().await.unwrap().text().await.unwrap();
    assert!(metrics.contains(r#"listener="admin""#), "{metrics}");
}

/// Every place of the main port is taken by a connection that has begun a request, and those for health checks too.
#[tokio::test(flavor = "multi_thread")]
async fn what_fills_the_main_port_does_not_reach_it() {
    let daemon = Daemon::start_with(|config| {
        with_admin(config);
        config.limits.requests_max = 2;
        config.limits.streams_max = 1;
        config.limits.watches_max = 1;
        config.limits.connections_max = 16;
        config.limits.connections_reserved = 1;
        config.limits.probes_max = 1;
    })
    .await;
    let mut held = Vec::new();
    for _ in 0..40 {
        let mut connection = TcpStream::connect(daemon.http).await.unwrap();
        connection.write_all(b"GET /livez HTTP/1.1\r\nhost: localhost\r\n").await.unwrap();
        held.push(connection);
    }
    let admin = daemon.admin.unwrap();
    for _ in 0..20 {
        let answer = tokio::time::timeout(Duration::from_secs(5), status(admin, "/readyz")).await;
        assert_eq!(answer.unwrap(), StatusCode::OK);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn it_says_that_the_server_goes_down_until_the_end() {
    let daemon = Daemon::start_with(|config| {
        with_admin(config);
        config.drain_delay_s = 2;
    })
    .await;
    let admin = daemon.admin.unwrap();
    let url = format!("http://{admin}/readyz");
    assert_eq!(status(admin, "/readyz").await, StatusCode::OK);
    let stopping = daemon.tell_to_stop();
    wait_until(async || {
        let answer = client().get(&url).send().await.unwrap();
        let is_leaving = answer.status() == StatusCode::SERVICE_UNAVAILABLE;
        is_leaving && answer.json::<Value>().await.unwrap()["reason"] == "draining"
    })
    .await;
    stopping.stopped().await;
    assert!(TcpStream::connect(admin).await.is_err(), "nobody listens any more");
}
