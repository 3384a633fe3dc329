//! `mrol cluster`: help, input that makes no sense, and settings for NATS servers.

use std::process::{Command, Stdio};

use super::support::skipped::skipped;
use super::{complaint, mrol, objects};

/// Port 9 of this machine, at which nothing listens.
const NOBODY: &str = "nats://127.0.0.1:9";

#[test]
fn every_command_explains_itself_with_examples() {
    for command in ["status", "check", "move", "copies", "adopt", "keep", "forget", "config"] {
        let help = mrol(&["cluster", command, "--help"]).assert().success().get_output().stdout.clone();
        let help = String::from_utf8(help).unwrap();
        let example = format!("EXAMPLES:\n  mrol cluster {command} ");
        assert!(help.contains(&example), "{help}");
    }
}

#[test]
fn a_command_that_cannot_reach_nats_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().to_str().unwrap();
    std::fs::create_dir(folder.path().join("maps")).unwrap();
    let commands: [&[&str]; 7] = [
        &["status"],
        &["check"],
        &["move", "office", "n2"],
        &["copies", "office", "n1,n2"],
        &["adopt", data],
        &["keep", "n2", "office"],
        &["forget", "n3"],
    ];
    for command in commands {
        let call = [&["cluster"], command].concat();
        let missing = complaint(&call, 2);
        assert!(missing.contains("no NATS servers are given: --nats nats://HOST:PORT"), "{missing}");
        let nobody = complaint(&[&call[..], &["--nats", NOBODY]].concat(), 1);
        assert!(nobody.contains(&format!("no NATS server at {NOBODY} answered")), "{nobody}");
        assert!(nobody.contains("start one, or correct the addresses"), "{nobody}");
    }
}

#[test]
fn input_that_makes_no_sense_is_named_with_its_limit() {
    for (call, parts) in [
        (&["move", "office", "N 2"][..], &["NODE", "N 2", "[a-z0-9][a-z0-9_-]{0,63}"][..]),
        (&["move", "Office", "n2"], &["<MAP>", "Office"]),
        (&["move", "office"], &["NODE"]),
        (&["move", "office", "n2", "--any"], &["--any"]),
        (&["move", "office", "n2", "--wait", "soon"], &["--wait", "soon", "90s"]),
        (&["copies", "office", "n1,N 2"], &["NODES", "N 2", "[a-z0-9][a-z0-9_-]{0,63}"]),
        (&["copies", "office"], &["NODES"]),
        (&["keep", "n2", "office", "--out", "office.ply", "--nats", NOBODY], &["answered"]),
        (&["check", "--monitor", "https://a:8222"], &["--monitor", "https://a:8222", "http://HOST:PORT"]),
        (&["adopt", "/no-such-folder", "--nats", NOBODY], &["/no-such-folder is no data folder"]),
    ] {
        let call = [&["cluster"], call].concat();
        let output = mrol(&call).assert().failure().get_output().clone();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(parts.iter().all(|part| said.contains(part)), "{call:?}: {said}");
    }
}

#[test]
fn a_server_leaves_its_cluster_or_is_in_one() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().to_str().unwrap();
    let both = ["serve", "--leave-cluster", "--cluster", NOBODY, "--node", "n1", "--data-dir", data];
    let refused = complaint(&both, 2);
    assert!(refused.contains("--leave-cluster") && refused.contains("cluster.nats"), "{refused}");
    let nowhere = complaint(&["serve", "--leave-cluster", "--data-dir", ""], 2);
    assert!(nowhere.contains("--leave-cluster is of no use without a data folder"), "{nowhere}");
}

fn config<'a>(server: &'a str, host: &'a str, peers: &'a str) -> Vec<&'a str> {
    vec!["cluster", "config", "--server", server, "--host", host, "--peers", peers]
}

#[test]
fn settings_of_a_nats_server_that_make_no_sense_are_refused() {
    for (server, host, peers, said) in [
        ("n1", "a", "a,b", "--peers must name 1, 3 or 5 hosts, got 2"),
        ("n1", "d", "a,b,c", "--host must be one of --peers (a,b,c), got d"),
        ("n1", "a", "a,b,b", "--peers names b twice"),
        ("n 1", "a", "a", "of [A-Za-z0-9_-], got \"n 1\""),
        ("n1", "a:4222", "a:4222", "without a port, [..] around one of IPv6, got \"a:4222\""),
        ("n1", "a\"", "a", "got \"a\\\"\""),
        ("n1", "::1", "::1", "got \"::1\""),
    ] {
        let refused = complaint(&config(server, host, peers), 2);
        assert!(refused.contains(said), "{refused}");
    }
    mrol(&config("n1", "[::1]", "[::1],b,c")).assert().success();
}

#[test]
fn nats_accepts_the_settings_that_are_printed() {
    let Some(program) = std::env::var_os("NATS_SERVER_PROGRAM") else {
        return skipped("no nats-server (set NATS_SERVER_PROGRAM to what .ci/nats-server prints)");
    };
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("store");
    for peers in ["127.0.0.1", "127.0.0.1,10.0.0.2,nats-3.example.org"] {
        let mut call = config("n1", "127.0.0.1", peers);
        call.extend(["--store-dir", store.to_str().unwrap()]);
        let printed = mrol(&call).assert().success().get_output().stdout.clone();
        let text = objects(&call)[0]["nats_server_conf"].as_str().unwrap().trim_end().to_owned();
        assert_eq!(String::from_utf8(printed.clone()).unwrap().trim_end(), text);
        assert_eq!(text.contains("routes: ["), peers.contains(','), "{text}");
        let path = folder.path().join("nats-server.conf");
        std::fs::write(&path, printed).unwrap();
        let tested =
            Command::new(&program).arg("-t").arg("-c").arg(&path).stdin(Stdio::null()).output().unwrap();
        assert!(tested.status.success(), "{}\n{text}", String::from_utf8_lossy(&tested.stderr));
    }
}
