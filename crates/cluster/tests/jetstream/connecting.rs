//! A connection says why there is none.

use std::time::{Duration, Instant};

use mrol_cluster::{ConnectError, Credentials, Engine};

use crate::support::{NatsServers, eventually};

#[test]
fn where_no_server_is_the_error_names_the_addresses() {
    let Some(mut servers) = NatsServers::start(1) else { return };
    servers.kill_all();
    let begun = Instant::now();
    let error = Engine::connect(&servers.settings()).unwrap_err();
    assert!(matches!(error, ConnectError::NoServer { .. }), "{error}");
    assert!(error.to_string().contains(&servers.urls()[0]), "{error}");
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
}

#[test]
fn a_password_in_the_address_is_given_and_never_shown() {
    let more = "authorization { users: [{ user: mrol, password: right }] }";
    let Some(servers) = NatsServers::start_with(1, more, "") else { return };
    let mut settings = servers.settings();
    let with = |password: &str| settings.urls[0].replace("nats://", &format!("nats://mrol:{password}@"));
    let (right, wrong) = (with("right"), with("wrong"));
    settings.urls = vec![right];
    let engine = eventually(|| Engine::connect(&settings));
    assert!(engine.is_connected());
    assert!(!format!("{engine:?}").contains("right"));
    settings.urls = vec![wrong];
    let error = Engine::connect(&settings).unwrap_err();
    assert!(matches!(error, ConnectError::Unauthorized { .. }), "{error}");
    assert!(!error.to_string().contains("wrong"), "{error}");
}

#[test]
fn an_nkey_is_a_credential() {
    // A pair that the documentation of NATS has as its example.
    let seed = "SUANQDPB2RUOE4ETUA26CNX7FUKE5ZZKFCQIIW63OX225F2CO7UEXTM7ZY";
    let public = "UAMMBNV2EYR65NYZZ7IAK5SIR5ODNTTERJOBOF4KJLMWI45YOXOSWULM";
    let more = format!("authorization {{ users: [{{ nkey: {public} }}] }}");
    let Some(servers) = NatsServers::start_with(1, &more, "") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seed");
    std::fs::write(&path, format!("{seed}\n")).unwrap();
    let mut settings = servers.settings();
    let error = eventually(|| match Engine::connect(&settings) {
        Err(error @ ConnectError::Unauthorized { .. }) => Ok(error),
        Err(error) => Err(error.to_string()),
        Ok(_) => panic!("no key was given"),
    });
    assert!(error.to_string().contains("nkey"), "{error}");
    settings.credentials = Credentials::NkeySeedFile(path);
    assert!(Engine::connect(&settings).unwrap().is_connected());
    settings.credentials = Credentials::CredentialsFile(folder.path().join("none"));
    let error = Engine::connect(&settings).unwrap_err();
    assert!(matches!(error, ConnectError::Credentials { .. }), "{error}");
}

#[test]
fn servers_without_a_leader_lack_a_quorum_and_not_the_right() {
    let Some(mut servers) = NatsServers::start(3) else { return };
    drop(servers.engine());
    servers.kill(0);
    servers.kill(1);
    // The last server answers for some seconds that it does not know who leads, and then that nobody does.
    let said = eventually(|| match Engine::connect(&servers.settings()) {
        Ok(_) => Err("connected".to_owned()),
        Err(error @ ConnectError::NoQuorum { .. }) if error.to_string().contains("10008") => Ok(error),
        Err(error) => {
            assert!(matches!(error, ConnectError::NoQuorum { .. }), "{error}");
            Err(error.to_string())
        }
    });
    assert!(said.to_string().contains("most of the NATS servers must run"), "{said}");
}
