//! The files that an operator writes: settings and keys.

use std::cell::RefCell;
use std::io::{Seek, Write};
use std::path::Path;

use mrol::access::Access;
use mrol::config::{Config, ConfigError};
use serde_json::json;
use tempfile::NamedTempFile;

/// Characters of a message about keys, besides the file's name, at most: it repeats nothing that may be a secret.
const MESSAGE_MAX: usize = 220;

/// The daemon's settings: what is accepted can be used, and reads the same when it was printed.
pub(super) fn config(bytes: &[u8]) {
    match load(bytes) {
        Ok(config) => {
            let _usable = (config.service_settings(), config.drain());
            let printed = toml::to_string(&config).expect("settings can be printed");
            let again = load(printed.as_bytes()).expect("what was printed");
            // As text, in which NaN equals itself.
            assert_eq!(toml::to_string(&again).expect("settings can be printed"), printed);
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// The keys of those who may ask: some, or a refusal that names the place and no value.
pub(super) fn keys(bytes: &[u8]) {
    in_file(bytes, |path| match Access::by_keys_of(path, false) {
        Ok(access) => assert!(access.keys().is_some_and(|keys| !keys.current().is_empty())),
        Err(error) => {
            let message = error.to_string().replace(&path.display().to_string(), "");
            assert!(message.starts_with(": ") && message.chars().count() < MESSAGE_MAX, "{message}");
        }
    });
}

fn load(toml: &[u8]) -> Result<Config, ConfigError> {
    in_file(toml, |path| Config::load(Some(path), json!({})))
}

fn in_file<T>(bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
    thread_local! {
        static FILE: RefCell<NamedTempFile> = RefCell::new(NamedTempFile::new().expect("a file"));
    }
    FILE.with_borrow_mut(|file| {
        file.rewind().and_then(|()| file.write_all(bytes)).expect("a file that can be written");
        file.as_file().set_len(bytes.len() as u64).expect("a file that can be cut");
        read(file.path())
    })
}
