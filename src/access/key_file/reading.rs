//! Reads and lists files of keys.

use super::entry::KeyEntry;
use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize};

use crate::access::key::{Key, KeyName};

/// Why there are no keys.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileError {
    /// The file cannot be read or written.
    #[error("{}: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The file has something else than keys.
    #[error(
        "{}: line {line} must belong to a [[key]] of name, sha256, scope and, where they are meant, maps, robots, expires, \
         requests_per_s_max, burst_max, requests_at_once_max, former_sha256 and former_expires",
        path.display()
    )]
    Form {
        /// The file.
        path: PathBuf,
        /// Where reading ended, from 1.
        line: usize,
    },
    /// A key is none.
    #[error("{}: key {place}: {problem}", path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// Which one, from 1.
        place: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// There is no key in it.
    #[error("{}: there is no [[key]] in it, so that nobody could do anything; `mrol key new` makes one", .0.display())]
    Empty(PathBuf),
    /// There is no key of a name in it.
    #[error("{}: there is no key {name} in it; `mrol key list` shows those that are", path.display())]
    Unknown {
        /// The file.
        path: PathBuf,
        /// The name.
        name: KeyName,
    },
    /// A secret before the last one still counts.
    #[error(
        "{}: key {name} is being rotated: its former secret counts until {until}; --end-former ends it first",
        path.display()
    )]
    Rotating {
        /// The file.
        path: PathBuf,
        /// Whose.
        name: KeyName,
        /// Until when.
        until: String,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileToml {
    #[serde(default)]
    key: Vec<KeyEntry>,
}

/// The keys of a file: each secret's by itself.
pub(crate) fn read(path: &Path) -> Result<Vec<Key>, KeyFileError> {
    let keys = parse(path, &read_text(path)?)?;
    if keys.is_empty() { Err(KeyFileError::Empty(path.to_owned())) } else { Ok(keys) }
}

/// The tables of a file, as they stand there.
///
/// # Errors
/// When the file cannot be read, or is none of keys.
pub fn list_file(path: &Path) -> Result<Vec<KeyEntry>, KeyFileError> {
    let text = read_text(path)?;
    parse(path, &text)?;
    Ok(parse_toml(path, &text)?.key)
}

/// A key as a file holds it.
pub fn to_toml(key: &Key) -> String {
    // Texts, numbers, times and lists of texts are always TOML.
    toml::to_string(&FileToml { key: vec![KeyEntry::of(key)] }).unwrap_or_default()
}

fn read_text(path: &Path) -> Result<String, KeyFileError> {
    fs::read_to_string(path).map_err(|error| in_file(path, error))
}

fn parse_toml(path: &Path, text: &str) -> Result<FileToml, KeyFileError> {
    toml::from_str(text).map_err(|error| {
        let end = error.span().map_or(0, |span| span.start);
        let line = 1 + text.bytes().take(end).filter(|&byte| byte == b'\n').count();
        KeyFileError::Form { path: path.to_owned(), line }
    })
}

pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<Key>, KeyFileError> {
    let file = parse_toml(path, text)?;
    let mut keys: Vec<Key> = Vec::with_capacity(file.key.len());
    for (i, entry) in file.key.iter().enumerate() {
        let wrong = |problem| KeyFileError::Key { path: path.to_owned(), place: i + 1, problem };
        let (key, former) = entry.keys().map_err(wrong)?;
        if keys.iter().any(|other| other.name == key.name) {
            return Err(wrong("another key has that name"));
        }
        for secret in [Some(key), former].into_iter().flatten() {
            if keys.iter().any(|other| other.digest == secret.digest) {
                return Err(wrong("another key has that sha256"));
            }
            keys.push(secret);
        }
    }
    Ok(keys)
}

pub(super) fn in_file(path: &Path, error: io::Error) -> KeyFileError {
    KeyFileError::File { path: path.to_owned(), error }
}
