//! The file of keys: TOML, a table a key.
//!
//! ```toml
//! [[key]]
//! name = "planner"
//! sha256 = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"   # of the secret
//! scope = "read"                 # read, write or admin
//! maps = ["hall", "office"]      # without it: every map
//! ```
//!
//! It holds hashes, so that whoever reads it can open nothing with it. What is wrong with it is said without repeating
//! any value: somebody may have put a secret where none belongs.

use std::io::Write;
use std::os::unix::fs::{MetadataExt, fchown};
use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize};

use super::{Digest, Key, KeyName, Scope};
use crate::map::MapName;
use crate::service::MapReach;

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
    /// It is not made of keys.
    #[error(
        "{}: line {line} must belong to a [[key]] of name, sha256, scope and, where it is not for every map, maps",
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
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileToml {
    #[serde(default)]
    key: Vec<KeyToml>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KeyToml {
    name: String,
    sha256: String,
    scope: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    maps: Option<Vec<String>>,
}

/// The keys of a file.
pub(super) fn read(path: &Path) -> Result<Vec<Key>, KeyFileError> {
    let text = fs::read_to_string(path).map_err(|error| in_file(path, error))?;
    let keys = parse(path, &text)?;
    if keys.is_empty() { Err(KeyFileError::Empty(path.to_owned())) } else { Ok(keys) }
}

/// Adds a key to a file, which is made where there is none, for its owner alone. It is replaced as a whole, so that a
/// server reads the former one or the new one.
///
/// # Errors
/// When what is there is no file of keys, has a key of that name, or cannot be replaced.
pub fn add_to_file(path: &Path, key: &Key) -> Result<(), KeyFileError> {
    let failed = |error| in_file(path, error);
    let text = match fs::read_to_string(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
        text => text.map_err(failed)?,
    };
    let gap = if text.is_empty() || text.ends_with("\n\n") { "" } else { "\n" };
    let text = format!("{text}{gap}{}", to_toml(key));
    parse(path, &text)?;

    // What a link leads to is replaced, not the link.
    let path = &fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    replace(path, &text).map_err(failed)
}

/// Replaces a file, or makes one for its owner alone. Who may read it stays.
fn replace(path: &Path, text: &str) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut new = tempfile::NamedTempFile::new_in(folder)?;
    new.write_all(text.as_bytes())?;
    if let Ok(there) = fs::metadata(path) {
        new.as_file().set_permissions(there.permissions())?;
        // The administrator may give a file away to the server's user; others may not, and keep it for themselves.
        let _ = fchown(new.as_file(), Some(there.uid()), Some(there.gid()));
    }
    new.as_file().sync_all()?;
    new.persist(path)?;
    Ok(())
}

/// A key as a file holds it.
pub fn to_toml(key: &Key) -> String {
    let maps = match &key.reach {
        MapReach::Every => None,
        MapReach::Only(names) => Some(names.iter().map(MapName::to_string).collect()),
    };
    let (name, sha256, scope) = (key.name.to_string(), key.digest.to_string(), key.scope.to_string());
    let file = FileToml { key: vec![KeyToml { name, sha256, scope, maps }] };
    // Texts and lists of texts are always TOML.
    toml::to_string(&file).unwrap_or_default()
}

fn parse(path: &Path, text: &str) -> Result<Vec<Key>, KeyFileError> {
    let file: FileToml = toml::from_str(text).map_err(|error| {
        let end = error.span().map_or(0, |span| span.start);
        let line = 1 + text.bytes().take(end).filter(|&byte| byte == b'\n').count();
        KeyFileError::Form { path: path.to_owned(), line }
    })?;
    let mut keys: Vec<Key> = Vec::with_capacity(file.key.len());
    for (i, key) in file.key.iter().enumerate() {
        let wrong = |problem| KeyFileError::Key { path: path.to_owned(), place: i + 1, problem };
        let key = Key::try_from(key).map_err(wrong)?;
        if keys.iter().any(|other| other.name == key.name) {
            return Err(wrong("another key has that name"));
        }
        if keys.iter().any(|other| other.digest == key.digest) {
            return Err(wrong("another key has that sha256"));
        }
        keys.push(key);
    }
    Ok(keys)
}

impl TryFrom<&KeyToml> for Key {
    type Error = &'static str;

    fn try_from(key: &KeyToml) -> Result<Self, &'static str> {
        let name = KeyName::new(&key.name).ok_or("name must be 1 to 64 of [A-Za-z0-9_.-]")?;
        let digest =
            Digest::parse(&key.sha256).ok_or("sha256 must be the 64 hexadecimal digits of a hash")?;
        let scope = Scope::ALL.into_iter().find(|scope| scope.as_str() == key.scope);
        let reach = key.maps.as_deref().map_or(Ok(MapReach::Every), reach_of)?;
        Ok(Self::new(name, digest, scope.ok_or("scope must be read, write or admin")?, reach))
    }
}

fn reach_of(maps: &[String]) -> Result<MapReach, &'static str> {
    if maps.is_empty() {
        return Err("maps must name a map; without it the key is for every map");
    }
    let names = maps.iter().map(|name| MapName::new(name)).collect::<Result<_, _>>();
    names.map_err(|_| "maps must be names of maps: [a-z0-9][a-z0-9_-]{0,63}")
}

fn in_file(path: &Path, error: io::Error) -> KeyFileError {
    KeyFileError::File { path: path.to_owned(), error }
}
