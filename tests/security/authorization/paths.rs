//! Names that would be paths never reach the file system.

use std::collections::BTreeMap;
use std::fs;
use std::net::SocketAddr;
use std::path::Path;

use mrol::access::Operation;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tonic::Code;

use super::asking::first_answer;
use super::requests::{body, message, names_a_map};
use crate::support::daemon::Daemon;

/// What a file system, or a parser on the way to it, may take for something else than a name.
const TRICKS: [&str; 20] = [
    "..",
    ".",
    "../canary",
    "../../canary",
    "./own",
    "own/..",
    "own/../../canary",
    "/etc/passwd",
    "/",
    "own.mrol",
    "own\0",
    "..\\canary",
    "C:\\canary",
    "~",
    "-rf",
    "own\n",
    "%2e%2e%2fcanary",
    "..%252fcanary",
    "\u{ff0e}\u{ff0e}\u{2215}canary",
    LONG,
];

/// Longer than any file's name may be.
const LONG: &str = match std::str::from_utf8(&[b'a'; 5000]) {
    Ok(long) => long,
    Err(_) => panic!(),
};

/// Every file below a folder with what it holds.
fn files(folder: &Path, found: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => files(&path, found),
            false => drop(found.insert(path.display().to_string(), fs::read(&path).unwrap())),
        }
    }
}

fn snapshot(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    files(folder, &mut found);
    found
}

/// A name as a path of HTTP has it: every byte escaped.
fn escaped(name: &str) -> String {
    name.bytes().map(|byte| format!("%{byte:02X}")).collect()
}

/// The status of a request whose path is sent as it is: clients of HTTP tidy paths up.
async fn status(server: SocketAddr, method: &str, path: &str, body: &str) -> u16 {
    let request = format!(
        "{method} {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\
         connection: close\r\n\r\n{body}",
        body.len()
    );
    let mut connection = TcpStream::connect(server).await.unwrap();
    connection.write_all(request.as_bytes()).await.unwrap();
    let mut answer = String::new();
    connection.read_to_string(&mut answer).await.unwrap();
    answer.split(' ').nth(1).unwrap().parse().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn no_name_in_either_protocol_leads_to_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    for canary in ["canary", "canary.mrol"] {
        fs::write(folder.path().join(canary), canary).unwrap();
    }
    let daemon = Daemon::start_with(|config| config.data_dir = data.clone()).await;
    daemon.make_map("own").await;
    let (before, channel) = (snapshot(folder.path()), daemon.channel().await);
    for &operation in Operation::ALL.iter().filter(|operation| names_a_map(**operation)) {
        for trick in TRICKS {
            if let Some(call) = operation.grpc() {
                let asked = first_answer(channel.clone(), call, message(operation, trick), None).await;
                assert_eq!(asked.unwrap_err().code(), Code::InvalidArgument, "{operation:?} {trick:?}");
            }
            let Some(route) = operation.route() else { continue };
            let body = body(operation).map(|body| body.to_string()).unwrap_or_default();
            let path = route.path.replace("{map}", &escaped(trick));
            let answered = status(daemon.http, route.method, &path, &body).await;
            assert_eq!(answered, 400, "{operation:?} {trick:?}");
            // As it is, it may be another route, or none; never one that leads out of here.
            if !trick.contains(char::is_control) {
                let answered =
                    status(daemon.http, route.method, &route.path.replace("{map}", trick), &body).await;
                assert!((400..500).contains(&answered), "{operation:?} {trick:?}: {answered}");
            }
        }
    }
    assert_eq!(snapshot(folder.path()), before);
}
