//! `mrol insert` over connections that break.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use super::{Sequence, mrol, objects};
use crate::support::process::Process;

const SCANS: usize = 4;

/// Forwards connections to a server, and ends the first one once so many bytes came from the client, each later one
/// after so many others; its address.
fn proxy(server: &str, first: usize, later: usize) -> String {
    let (listener, server) = (TcpListener::bind("127.0.0.1:0").unwrap(), server.replace("http://", ""));
    let address = format!("http://{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for (k, client) in listener.incoming().flatten().enumerate() {
            let Ok(upstream) = TcpStream::connect(&server) else { return };
            let limit = if k == 0 { first } else { later };
            for (from, to, limit) in [(&client, &upstream, limit), (&upstream, &client, usize::MAX)] {
                let (from, to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                std::thread::spawn(move || forward(from, to, limit));
            }
        }
    });
    address
}

fn forward(mut from: TcpStream, mut to: TcpStream, limit: usize) {
    let (mut buffer, mut forwarded) = ([0; 4096], 0);
    while let Ok(read @ 1..) = from.read(&mut buffer) {
        forwarded += read;
        if forwarded > limit || to.write_all(&buffer[..read]).is_err() {
            break;
        }
    }
    for end in [from, to] {
        let _ = end.shutdown(Shutdown::Both);
    }
}

/// A sequence, the bytes of one and a half of its scans, and a server that has an empty map for it.
fn sequence_and_server() -> (Sequence, usize, Process) {
    let (sequence, server) = (Sequence::of(SCANS), Process::start("", &[]));
    let bytes = std::fs::metadata(sequence.path("scans/0000.ply")).unwrap().len() as usize;
    objects(&["maps", "create", "a", "--resolution", "0.1", "--server", &server.grpc]);
    (sequence, bytes + bytes / 2, server)
}

fn scans_in_map(server: &Process) -> Value {
    objects(&["maps", "show", "a", "--server", &server.grpc])[0]["scans"].clone()
}

#[test]
fn scans_are_sent_on_after_the_connection_broke_and_none_twice() {
    let (sequence, bytes, server) = sequence_and_server();
    let (scans, truth) = (sequence.path("scans"), sequence.path("poses.txt"));
    let through = proxy(&server.grpc, bytes, usize::MAX);
    let insert = ["insert", &scans, "--map", "a", "--poses", &truth, "--json", "--server", &through];
    let output = mrol(&insert).assert().success().get_output().clone();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("going on with 000"), "{said}");
    let lines = String::from_utf8(output.stdout).unwrap();
    let names: Vec<Value> =
        lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap()["scan"].clone()).collect();
    assert_eq!(names, ["0000.ply", "0001.ply", "0002.ply", "0003.ply"]);
    assert_eq!(scans_in_map(&server), SCANS);
}

#[test]
fn who_gives_up_is_told_how_to_go_on_and_going_on_adds_no_scan_twice() {
    let (sequence, bytes, server) = sequence_and_server();
    let (scans, truth) = (sequence.path("scans"), sequence.path("poses.txt"));
    let through = proxy(&server.grpc, bytes, 2000);
    let insert = ["insert", &scans, "--map", "a", "--poses", &truth, "--json"];
    let failing = [&insert[..], &["--patience", "1", "--server", &through]].concat();
    let said = String::from_utf8(mrol(&failing).assert().code(1).get_output().stderr.clone()).unwrap();
    let (_, options) = said.split_once("The same command with ").expect(&said);
    let (options, _) = options.split_once(" goes on").expect(&said);
    let options: Vec<&str> = options.split(' ').collect();
    assert_eq!((options[0], &options[2..]), ("--session", &["--first-scan-id", "0"][..]), "{said}");

    let again = objects(&[&insert[..6], &options, &["--server", &server.grpc]].concat());
    assert_eq!(again.len(), SCANS);
    assert!(again.iter().all(|line| line["accepted"] == true), "{again:?}");
    assert_eq!(scans_in_map(&server), SCANS);
}

/// Forwards connections to a server, and what a client sends a little at a time; its address.
fn slow_proxy(server: &str) -> String {
    let (listener, server) = (TcpListener::bind("127.0.0.1:0").unwrap(), server.replace("http://", ""));
    let address = format!("http://{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for mut client in listener.incoming().flatten() {
            let Ok(mut upstream) = TcpStream::connect(&server) else { return };
            let (from, to) = (upstream.try_clone().unwrap(), client.try_clone().unwrap());
            std::thread::spawn(move || forward(from, to, usize::MAX));
            std::thread::spawn(move || {
                let mut buffer = [0; 4096];
                while let Ok(read @ 1..) = client.read(&mut buffer) {
                    std::thread::sleep(Duration::from_millis(50));
                    if upstream.write_all(&buffer[..read]).is_err() {
                        break;
                    }
                }
            });
        }
    });
    address
}

#[test]
fn who_stops_since_the_map_was_renamed_is_told_how_to_go_on_and_going_on_adds_no_scan_twice() {
    let (sequence, _, server) = sequence_and_server();
    let (scans, truth) = (sequence.path("scans"), sequence.path("poses.txt"));
    let through = slow_proxy(&server.grpc);
    let mut insert = Command::new(env!("CARGO_BIN_EXE_mrol"));
    insert.args(["insert", &scans, "--map", "a", "--poses", &truth, "--json", "--server", &through]);
    let mut insert = insert.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut first = String::new();
    BufReader::new(insert.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(first.contains("0000.ply"), "{first}");
    objects(&["maps", "rename", "a", "b", "--server", &server.grpc]);
    let output = insert.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("map_not_found") && !said.contains("--create"), "{said}");
    let (_, options) = said.split_once("The same command with ").expect(&said);
    let (options, _) = options.split_once(" goes on").expect(&said);
    let options: Vec<&str> = options.split(' ').collect();
    let again = ["insert", &scans, "--map", "b", "--poses", &truth, "--server", &server.grpc];
    assert_eq!(objects(&[&again[..], &options].concat()).len(), SCANS);
    assert_eq!(objects(&["maps", "show", "b", "--server", &server.grpc])[0]["scans"], SCANS);
}
