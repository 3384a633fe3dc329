//! The daemon's settings.

use std::cell::RefCell;
use std::io::{Seek, Write};

use mrol::config::{Config, ConfigError};
use serde_json::json;
use tempfile::NamedTempFile;

/// A configuration file: what is accepted can be used, and reads the same when it was printed.
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

fn load(toml: &[u8]) -> Result<Config, ConfigError> {
    thread_local! {
        static FILE: RefCell<NamedTempFile> = RefCell::new(NamedTempFile::new().expect("a file"));
    }
    FILE.with_borrow_mut(|file| {
        file.rewind().and_then(|()| file.write_all(toml)).expect("a file that can be written");
        file.as_file().set_len(toml.len() as u64).expect("a file that can be cut");
        Config::load(Some(file.path()), json!({}))
    })
}
