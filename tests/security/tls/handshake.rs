//! Who is let in, and how.

use std::sync::Arc;

use mrol::client::{Client, Credentials};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, RootCertStore};

use super::authority::{Authority, Files, ask};
use crate::support::daemon::Daemon;

/// A secured connection to `port`, where one of `protocols` is spoken.
pub(crate) async fn connected(authority: &Authority, port: u16, protocols: &[&[u8]]) -> TlsStream<TcpStream> {
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from_pem_slice(authority.pem().as_bytes()).unwrap()).unwrap();
    let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()));
    let config = config.with_safe_default_protocol_versions().unwrap().with_root_certificates(roots);
    let mut config = config.with_no_client_auth();
    config.alpn_protocols = protocols.iter().map(|protocol| protocol.to_vec()).collect();
    let stream = TcpStream::connect(("127.0.0.1", port)).await.unwrap();
    let name = ServerName::try_from("localhost").unwrap();
    TlsConnector::from(Arc::new(config)).connect(name, stream).await.unwrap()
}

async fn served() -> (Authority, Daemon) {
    let authority = Authority::new();
    let daemon = Files::of(&authority.sign()).serve(None).await;
    (authority, daemon)
}

#[tokio::test(flavor = "multi_thread")]
async fn grpc_is_spoken_with_who_trusts_the_authority_and_with_nobody_else() {
    let (authority, daemon) = served().await;
    ask(&daemon, &authority.trusted()).await.unwrap();

    let stranger = ask(&daemon, &Authority::new().trusted()).await.unwrap_err().to_string();
    assert!(stranger.contains("certificate"), "{stranger}");
    let system = ask(&daemon, &Credentials::default()).await.unwrap_err().to_string();
    assert!(system.contains("certificate") || system.contains("TLS"), "{system}");
    let in_the_clear = Client::connect(&format!("http://{}", daemon.grpc)).await;
    assert!(in_the_clear.unwrap().list_maps().await.is_err());
}

#[tokio::test(flavor = "multi_thread")]
async fn http_is_spoken_over_tls_in_either_version() {
    let (authority, daemon) = served().await;
    let mut connection = connected(&authority, daemon.http.port(), &[b"http/1.1"]).await;
    assert_eq!(connection.get_ref().1.alpn_protocol(), Some(&b"http/1.1"[..]));
    connection
        .write_all(b"GET /readyz HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n")
        .await
        .unwrap();
    let mut answer = String::new();
    connection.read_to_string(&mut answer).await.unwrap();
    assert!(answer.starts_with("HTTP/1.1 200 OK") && answer.ends_with(r#"{"ready":true}"#), "{answer}");

    for port in [daemon.http.port(), daemon.grpc.port()] {
        let connection = connected(&authority, port, &[b"h2", b"http/1.1"]).await;
        assert_eq!(connection.get_ref().1.alpn_protocol(), Some(&b"h2"[..]));
    }
    let in_the_clear = reqwest::get(daemon.url("/readyz")).await;
    assert!(in_the_clear.is_err(), "{in_the_clear:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn where_clients_need_a_certificate_only_those_of_the_authority_count() {
    let (servers, clients) = (Authority::new(), Authority::new());
    let files = Files::of(&servers.sign());
    let client_ca = files.write("clients.pem", &clients.pem());
    let daemon = files.serve(Some(&client_ca)).await;

    let signed = clients.sign();
    let member =
        servers.trusted().with_identity(signed.certificate.as_bytes(), signed.key.as_bytes()).unwrap();
    ask(&daemon, &member).await.unwrap();
    assert!(ask(&daemon, &servers.trusted()).await.is_err());
    let foreign = Authority::new().sign();
    let stranger =
        servers.trusted().with_identity(foreign.certificate.as_bytes(), foreign.key.as_bytes()).unwrap();
    assert!(ask(&daemon, &stranger).await.is_err());
    // HTTP alike.
    let mut connection = connected(&servers, daemon.http.port(), &[b"http/1.1"]).await;
    let _ = connection.write_all(b"GET /readyz HTTP/1.1\r\nhost: localhost\r\n\r\n").await;
    let refused = connection.read_u8().await.unwrap_err().to_string();
    assert!(refused.contains("CertificateRequired"), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unix_socket_stays_in_the_clear() {
    let files = Files::of(&Authority::new().sign());
    let (tls, socket) = (files.settings(None), files.path("grpc.sock"));
    let daemon = Daemon::start_with(|config| {
        config.tls = tls;
        config.grpc.socket = Some(socket.clone());
    });
    let _daemon = daemon.await;
    let client = Client::connect(&format!("unix:{}", socket.display())).await.unwrap();
    assert!(client.list_maps().await.unwrap().maps.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn who_never_finishes_the_handshake_keeps_nobody_waiting() {
    let (authority, daemon) = served().await;
    let _silent = [TcpStream::connect(daemon.grpc).await, TcpStream::connect(daemon.http).await];
    ask(&daemon, &authority.trusted()).await.unwrap();
    daemon.stop().await;
}
