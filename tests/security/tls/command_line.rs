//! The program speaks TLS and shows keys.

use std::process::Command;

use super::authority::{Authority, Files};
use crate::support::process::Process;

/// A call of the program, away from the caller's settings; what it says, and its exit code.
fn mrol(arguments: &[&str], variables: &[(&str, &str)]) -> (String, Option<i32>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mrol"));
    for name in ["MROL_SERVER", "MROL_CONFIG", "MROL_KEY", "MROL_KEY_FILE", "MROL_CA"] {
        command.env_remove(name);
    }
    let output = command.args(arguments).envs(variables.iter().copied()).output().unwrap();
    let said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    (said, output.status.code())
}

#[test]
fn a_key_is_made_and_used_over_mutual_tls() {
    let authority = Authority::new();
    let files = Files::of(&authority.sign());
    let path = |name: &str| files.path(name).to_str().unwrap().to_owned();
    let ca = files.write("ca.pem", &authority.pem()).to_str().unwrap().to_owned();
    let client = authority.sign();
    files.write("client.pem", &client.certificate);
    files.write("client.key", &client.key);

    let keys = path("keys.toml");
    let new = |name, scope| {
        let (secret, code) = mrol(&["key", "new", "--name", name, "--scope", scope, "--file", &keys], &[]);
        assert_eq!(code, Some(0), "{secret}");
        secret.trim().to_owned()
    };
    let (reader, operator) = (new("reader", "read"), new("operator", "admin"));
    files.write("operator.secret", &format!("{operator}\n"));

    let (certificate, key) = (path("certificate.pem"), path("key.pem"));
    let options = [
        ["--keys-file", &keys],
        ["--tls-certificate", &certificate],
        ["--tls-key", &key],
        ["--tls-client-ca", &ca],
    ];
    let server = Process::start("", &options.concat());
    let url = format!("https://localhost:{}", server.grpc.rsplit(':').next().unwrap());
    let (shown, proof) = (path("client.pem"), path("client.key"));
    let call = |arguments: &[&str], variables: &[(&str, &str)]| {
        let connection = ["--server", &url, "--ca", &ca, "--client-cert", &shown, "--client-key", &proof];
        mrol(&[arguments, &connection].concat(), variables)
    };
    assert_eq!(call(&["health"], &[]), ("serving\n".into(), Some(0)));
    let create = ["maps", "create", "a", "--resolution", "0.1"];
    let (said, code) = call(&create, &[]);
    assert!(code == Some(1) && said.contains("key_missing"), "{said}");
    assert!(said.contains("--key-file FILE or MROL_KEY_FILE names a file with the secret"), "{said}");
    let (said, code) = call(&create, &[("MROL_KEY", &reader)]);
    assert!(code == Some(1) && said.contains("scope_too_small"), "{said}");
    let (said, code) = call(&[&create[..], &["--key-file", &path("operator.secret")]].concat(), &[]);
    assert_eq!(code, Some(0), "{said}");
    let (said, code) = call(&["maps", "list", "--key", &reader], &[]);
    assert!(code == Some(0) && said.starts_with("a "), "{said}");

    // Without what mutual TLS asks for, and without trust.
    assert_eq!(mrol(&["health", "--server", &url, "--ca", &ca], &[]).1, Some(1));
    let (said, code) = mrol(&["health", "--server", &url], &[]);
    assert!(code == Some(1) && said.contains("certificate"), "{said}");
    let (said, code) = mrol(&["maps", "list", "--help"], &[("MROL_KEY", &reader)]);
    assert!(code == Some(0) && said.contains("MROL_KEY") && !said.contains(&reader), "{said}");
    assert_eq!(server.stop(), Some(0));
}

#[test]
fn what_the_settings_name_is_shown_and_no_secret() {
    let files = Files::of(&Authority::new().sign());
    let keys = files.path("keys.toml").to_str().unwrap().to_owned();
    let (secret, _) = mrol(&["key", "new", "--name", "a", "--scope", "read", "--file", &keys], &[]);
    let (printed, code) = mrol(&["config", "print", "--keys-file", &keys], &[("MROL_KEY", secret.trim())]);
    assert_eq!(code, Some(0), "{printed}");
    assert!(printed.contains(&format!("keys_file = \"{keys}\"")), "{printed}");
    assert!(!printed.contains("mrol_"), "{printed}");
    assert!(!printed.contains("sha256"), "{printed}");
}
