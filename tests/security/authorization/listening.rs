//! Off loopback, a server without keys does not start.

use std::fs::{self, File};
use std::process::Command;

use mrol::access::Scope;
use mrol::config::Config;
use mrol::server::{Server, ServerError};

use super::keyring::Keyring;
use crate::support::process::Process;

fn everywhere() -> Config {
    let mut config = Config { data_dir: "".into(), ..Config::default() };
    config.http.listen = "127.0.0.1:0".parse().unwrap();
    config.grpc.listen = "0.0.0.0:0".parse().unwrap();
    config
}

#[tokio::test]
async fn off_loopback_it_needs_keys_or_a_word_that_this_is_meant() {
    let refused = Server::bind(everywhere()).await.unwrap_err();
    assert!(matches!(refused, ServerError::Unguarded { protocol: "grpc", .. }), "{refused}");
    assert!(refused.to_string().contains("mrol key new") && refused.to_string().contains("--insecure-open"));

    let mut meant = everywhere();
    meant.access.open = true;
    Server::bind(meant).await.unwrap();

    let keyring = Keyring::empty();
    keyring.add("a", Scope::Read, None);
    let mut guarded = everywhere();
    guarded.access.keys_file = Some(keyring.file());
    Server::bind(guarded).await.unwrap();
}

#[tokio::test]
async fn keys_that_cannot_be_read_keep_it_from_starting() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    let start = async |text: Option<&str>| {
        if let Some(text) = text {
            std::fs::write(&file, text).unwrap();
        }
        let mut config = everywhere();
        config.access.keys_file = Some(file.clone());
        Server::bind(config).await.unwrap_err().to_string()
    };
    let named = |error: &str| error.starts_with("access.keys_file: ") && error.contains("keys.toml");
    let hash = "0".repeat(64);
    let key = |rest: &str| format!("[[key]]\nname = \"a\"\nsha256 = \"{hash}\"\nscope = \"read\"\n{rest}");
    for (text, problem) in [
        (None, "No such file"),
        (Some(String::new()), "there is no [[key]]"),
        (Some("key = 1".into()), "line 1 must belong"),
        (Some(key("secret = \"mrol_1\"")), "line "),
        (Some(key("maps = []")), "key 1: maps must name a map"),
        (Some(key("maps = [\"../a\"]")), "key 1: maps must be names"),
        (Some(key("robots = []")), "key 1: robots must name a robot"),
        (Some(key("robots = [\"a b\"]")), "key 1: robots must be names"),
        (Some(key("expires = 2027-01-31T12:00:00")), "key 1: expires must be a date"),
        (Some(key("requests_per_s_max = 0")), "must be 1 to 4294967295"),
        (Some(key("burst_max = 1")), "key 1: burst_max is of no use"),
        (Some(key("former_expires = 2027-01-31")), "key 1: former_expires is of no use"),
        (Some(key("").replace(&hash, "mrol_12345")), "key 1: sha256 must be the 64"),
        (Some(key("").replace("read", "root")), "key 1: scope must be read, insert, write or admin"),
        (Some(key("").replace("\"a\"", "\"a b\"")), "key 1: name must be 1 to 64"),
        (Some(key("") + &key("").replace("\"a\"", "\"b\"")), "key 2: another key has that sha256"),
    ] {
        let error = start(text.as_deref()).await;
        assert!(named(&error) && error.contains(problem), "{text:?}: {error}");
        assert!(!error.contains("mrol_1"), "{error}");
    }
}

#[test]
fn keys_that_would_travel_in_the_clear_are_warned_of() {
    let keyring = Keyring::empty();
    keyring.add("a", Scope::Read, None);
    let (folder, keys) = (tempfile::tempdir().unwrap(), keyring.file());
    let log = folder.path().join("log");
    let said = |grpc: &str| {
        let mut serve = Command::new(env!("CARGO_BIN_EXE_mrol"));
        serve.args(["serve", "--json", "--data-dir", "", "--log-level", "warn", "--keys-file"]).arg(&keys);
        serve.args(["--http-listen", "127.0.0.1:0", "--grpc-listen", grpc]);
        serve.stderr(File::create(&log).unwrap());
        Process::of(serve).stop();
        fs::read_to_string(&log).unwrap()
    };
    let warning = said("0.0.0.0:0");
    assert!(warning.contains("keys travel in the clear") && warning.contains("grpc"), "{warning}");
    assert_eq!(said("127.0.0.1:0"), "");
}

#[test]
fn a_variable_that_was_meant_to_be_a_setting_keeps_it_from_starting() {
    let mut serve = Command::new(env!("CARGO_BIN_EXE_mrol"));
    serve.args(["config", "print"]).env("MROL_ACCESS_KEYS_FILE", "keys.toml");
    let output = serve.output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("MROL_ACCESS_KEYS_FILE") && said.contains("MROL_ACCESS__KEYS_FILE"), "{said}");
}

#[test]
fn variables_of_others_are_left_alone_and_unknown_ones_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let mut serve = Command::new(env!("CARGO_BIN_EXE_mrol"));
    serve.args(["serve", "--json", "--data-dir", "", "--log-level", "warn"]);
    serve.args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"]);
    serve.env("MROL_SERVICE_HOST", "10.0.0.1").env("MROL_PORT_7333_TCP", "tcp://10.0.0.1:7333");
    serve.env("MROL_KEY", "mrol_1").env("MROL_KEYFILE", "k").stderr(File::create(&log).unwrap());
    Process::of(serve).stop();
    let said = fs::read_to_string(&log).unwrap();
    assert!(said.contains("MROL_KEYFILE") && said.lines().count() == 1, "{said}");
}
