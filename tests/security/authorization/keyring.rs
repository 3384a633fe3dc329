//! A server with keys, and their secrets.

use std::path::{Path, PathBuf};

use mrol::access::{Key, KeyName, Scope, Secret, add_to_file};
use mrol::config::Config;
use mrol::map::MapName;
use mrol::service::AllowedMaps;
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::support::daemon::{Daemon, client, identity_json};

/// A file of keys that a test writes.
pub(crate) struct Keyring {
    folder: TempDir,
}

impl Keyring {
    pub(crate) fn empty() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn file(&self) -> PathBuf {
        self.folder.path().join("keys.toml")
    }

    /// Adds a key for `maps`, or for every map; its secret.
    pub(crate) fn add(&self, name: &str, scope: Scope, maps: Option<&[&str]>) -> Secret {
        add(&self.file(), name, scope, maps)
    }

    /// Gives a key more lines of its table.
    pub(crate) fn set(&self, name: &str, lines: &str) {
        let text = std::fs::read_to_string(self.file()).unwrap();
        let line = format!("name = \"{name}\"\n");
        assert!(text.contains(&line));
        std::fs::write(self.file(), text.replace(&line, &format!("{line}{lines}\n"))).unwrap();
    }
}

/// Adds a key to a file; its secret.
pub(crate) fn add(file: &Path, name: &str, scope: Scope, maps: Option<&[&str]>) -> Secret {
    let secret = Secret::random().unwrap();
    let reach =
        maps.map_or(AllowedMaps::Every, |maps| maps.iter().map(|map| MapName::new(map).unwrap()).collect());
    let key = Key::new(KeyName::new(name).unwrap(), secret.digest(), scope, reach);
    add_to_file(file, &key).unwrap();
    secret
}

/// A server that asks for keys, with one that may do everything.
pub(crate) struct Guarded {
    pub(crate) daemon: Daemon,
    pub(crate) keyring: Keyring,
    pub(crate) master: Secret,
}

impl Guarded {
    /// With the keys that `fill` adds.
    pub(crate) async fn start_with<T>(fill: impl FnOnce(&Keyring) -> T) -> (Self, T) {
        Self::start_configured(fill, |_| ()).await
    }

    /// As [`Guarded::start_with`], with settings that `configure` changes.
    pub(crate) async fn start_configured<T>(
        fill: impl FnOnce(&Keyring) -> T,
        configure: impl FnOnce(&mut Config),
    ) -> (Self, T) {
        let keyring = Keyring::empty();
        let master = keyring.add("master", Scope::Admin, None);
        let filled = fill(&keyring);
        let daemon = Daemon::start_with(|config| {
            config.data_dir = "".into();
            config.access.keys_file = Some(keyring.file());
            configure(config);
        });
        (Self { daemon: daemon.await, keyring, master }, filled)
    }

    /// Asks over HTTP, with a key or without.
    pub(crate) async fn http(
        &self,
        method: Method,
        path: &str,
        key: Option<&Secret>,
        body: Option<Value>,
    ) -> Response {
        let mut request = client().request(method, self.daemon.url(path));
        if let Some(key) = key {
            request = request.bearer_auth(key.reveal());
        }
        if let Some(body) = body {
            request = request.json(&body);
        }
        request.send().await.unwrap()
    }

    /// Makes a map with a point, where it is not there yet.
    pub(crate) async fn make_map(&self, name: &str) {
        let master = Some(&self.master);
        let (path, settings) = (format!("/v1/maps/{name}"), json!({"resolution_m": 0.1, "levels": 2}));
        assert!(self.http(Method::PUT, &path, master, Some(settings)).await.status().is_success());
        let scan = json!({"robot": "r", "scan_id": 1, "points": [[1, 2, 3]], "guess": identity_json(), "align": false});
        let put = self.http(Method::POST, &format!("{path}/scans"), master, Some(scan)).await;
        assert_eq!(put.status(), StatusCode::OK);
    }

    /// The names of all maps.
    pub(crate) async fn maps(&self) -> Vec<String> {
        let list: Value =
            self.http(Method::GET, "/v1/maps", Some(&self.master), None).await.json().await.unwrap();
        let names = list["maps"].as_array().unwrap().iter();
        names.map(|map| map["map"].as_str().unwrap().to_owned()).collect()
    }
}
