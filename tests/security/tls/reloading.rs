//! Certificates change under a running server.

use std::time::{Duration, Instant};

use mrol::client::Credentials;

use super::authority::{Authority, Files, ask};
use crate::support::daemon::{Daemon, PATIENCE};

async fn until_trusted(daemon: &Daemon, credentials: &Credentials) {
    let start = Instant::now();
    while ask(daemon, credentials).await.is_err() {
        assert!(start.elapsed() < PATIENCE, "the certificate is not taken up");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_certificate_is_shown_to_new_connections_and_old_ones_go_on() {
    let (former, new) = (Authority::new(), Authority::new());
    let files = Files::of(&former.sign());
    let daemon = files.serve(None).await;
    let connected = ask(&daemon, &former.trusted()).await.unwrap();

    files.replace(&new.sign());
    until_trusted(&daemon, &new.trusted()).await;
    assert!(ask(&daemon, &former.trusted()).await.is_err());
    connected.list_maps().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_authority_of_clients_is_asked_of_new_connections() {
    let (servers, former, new) = (Authority::new(), Authority::new(), Authority::new());
    let files = Files::of(&servers.sign());
    let client_ca = files.write("clients.pem", &former.pem());
    let daemon = files.serve(Some(&client_ca)).await;
    let member = |authority: &Authority| {
        let signed = authority.sign();
        servers.trusted().with_identity(signed.certificate.as_bytes(), signed.key.as_bytes()).unwrap()
    };
    ask(&daemon, &member(&former)).await.unwrap();
    assert!(ask(&daemon, &member(&new)).await.is_err());
    files.write("clients.pem", &new.pem());
    until_trusted(&daemon, &member(&new)).await;
    assert!(ask(&daemon, &member(&former)).await.is_err());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_broken_certificate_leaves_the_one_that_was() {
    let authority = Authority::new();
    let files = Files::of(&authority.sign());
    let daemon = files.serve(None).await;
    let in_force = async || {
        let metrics = metrics_over_tls(&daemon, &authority).await;
        metrics.lines().find_map(|line| {
            line.strip_prefix("mrol_file_reload_ok{file=\"certificates\"} ").map(str::to_owned)
        })
    };
    assert_eq!(in_force().await.as_deref(), Some("1"));
    for (name, broken) in [("certificate.pem", "none"), ("key.pem", ""), ("key.pem", &authority.sign().key)] {
        files.write(name, broken);
        let start = Instant::now();
        while in_force().await.as_deref() != Some("0") {
            assert!(start.elapsed() < PATIENCE, "{name} is not looked at");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        files.replace(&authority.sign());
        while in_force().await.as_deref() != Some("1") {
            assert!(start.elapsed() < PATIENCE, "{name} stays broken");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }
}

pub(crate) async fn metrics_over_tls(daemon: &Daemon, authority: &Authority) -> String {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let mut connection = super::handshake::connected(authority, daemon.http.port(), &[b"http/1.1"]).await;
    connection
        .write_all(b"GET /metrics HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n")
        .await
        .unwrap();
    let mut answer = String::new();
    connection.read_to_string(&mut answer).await.unwrap();
    answer
}
