//! Certificates that cannot be used keep a server from starting, and the error names the setting and the file.

use mrol::config::Config;
use mrol::server::Server;

use super::authority::{Authority, Files};

#[tokio::test]
async fn what_cannot_be_used_is_named() {
    let (authority, other) = (Authority::new(), Authority::new().sign());
    for (name, text, words) in [
        ("certificate.pem", Some(""), ["tls.certificate: ", "there is no certificate in it"]),
        ("certificate.pem", None, ["tls.certificate: ", "No such file"]),
        ("key.pem", Some("-----BEGIN PRIVATE KEY-----\nsecret!\n"), ["tls.key: ", "it must be PEM"]),
        ("key.pem", Some(""), ["tls.key: ", "there is none in it"]),
        (
            "key.pem",
            Some(other.key.as_str()),
            ["tls.certificate and tls.key: ", "keys may not be consistent"],
        ),
        ("clients.pem", Some("nobody"), ["tls.client_ca: ", "there is no certificate in it"]),
    ] {
        let files = Files::of(&authority.sign());
        let client_ca = files.write("clients.pem", &authority.pem());
        match text {
            Some(text) => drop(files.write(name, text)),
            None => std::fs::remove_file(files.path(name)).unwrap(),
        }
        let tls = files.settings(Some(&client_ca));
        let mut config = Config { data_dir: "".into(), tls, ..Config::default() };
        config.http.listen.set_port(0);
        config.grpc.listen.set_port(0);
        let error = Server::bind(config).await.unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{name} {text:?}: {error}");
        assert!(!error.contains("secret"), "{error}");
    }
}
