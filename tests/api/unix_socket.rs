//! A server is reached through sockets in the file system as it is over TCP.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixListener;
use std::path::Path;

use mrol::client::Client;
use mrol::config::Config;
use mrol::geometry::Point;
use mrol::map::{Lookup, MapName};
use mrol::server::Server;
use mrol::service::PointQuery;
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::support::daemon::Daemon;

async fn listening_at(grpc: &Path, http: &Path) -> Daemon {
    Daemon::start_with(|config| {
        config.grpc.socket = Some(grpc.to_owned());
        config.http.socket = Some(http.to_owned());
    })
    .await
}

async fn bind_at(grpc: &Path) -> Result<Server, String> {
    let mut config = Config { data_dir: "".into(), ..Config::default() };
    config.http.listen.set_port(0);
    config.grpc.listen.set_port(0);
    config.grpc.socket = Some(grpc.to_owned());
    Server::bind(config).await.map_err(|error| error.to_string())
}

#[tokio::test]
async fn both_protocols_answer_on_their_sockets_and_take_the_files_away() {
    let folder = tempfile::tempdir().unwrap();
    let (grpc, http) = (folder.path().join("grpc.sock"), folder.path().join("http.sock"));
    let daemon = listening_at(&grpc, &http).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &[[1.0, 2.0, 3.0]]).await;
    assert_eq!(std::fs::metadata(&grpc).unwrap().permissions().mode() & 0o777, 0o660);

    let client = Client::connect(&format!("unix:{}", grpc.display())).await.unwrap();
    let query = PointQuery {
        points: vec![Point::new(1.0, 2.0, 3.0), Point::new(5.0, 2.0, 3.0)].into(),
        map_from_points: None,
        level: 0,
        lookup: Lookup::Exact,
        min_revision: None,
        map_uuid: None,
        keep_out: false,
    };
    let answer = client.query_points(&MapName::new("a").unwrap(), query).await.unwrap();
    assert_eq!(answer.occupied[0], 0b01);

    let mut connection = tokio::net::UnixStream::connect(&http).await.unwrap();
    connection.write_all(b"GET /readyz HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\r\n").await.unwrap();
    let mut answer = String::new();
    connection.read_to_string(&mut answer).await.unwrap();
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");

    drop(client);
    daemon.stop().await;
    assert!(!grpc.exists() && !http.exists());
}

#[tokio::test]
async fn a_file_left_behind_is_replaced_and_what_is_in_use_or_no_socket_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grpc.sock");
    // The file of a listener that is gone without removing it, as after `kill -9`.
    drop(UnixListener::bind(&path).unwrap());
    let server = bind_at(&path).await.unwrap();

    let in_use = bind_at(&path).await.unwrap_err();
    let named = format!("grpc cannot listen on {}", path.display());
    assert!(in_use.contains(&named) && in_use.contains("somebody answers"), "{in_use}");
    assert!(path.exists());
    drop(server);
    assert!(!path.exists());

    std::fs::write(&path, "notes").unwrap();
    let no_socket = bind_at(&path).await.unwrap_err();
    assert!(no_socket.contains(&named) && no_socket.contains("is no socket"), "{no_socket}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "notes");
}
