//! Changes of the file of keys. Each holds a lock from reading to replacing, so that none undoes another, and replaces
//! the file as a whole, so that a server reads the former one or the new one.

use std::fs;
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::io::Write;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, fchown};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

use super::reading::{KeyFileError, in_file, parse, to_toml};
use crate::access::expiry::Expiry;
use crate::access::key::{Key, KeyName};
use crate::access::secret::Digest;

/// Adds a key to a file, which is made where there is none, for its owner alone.
///
/// # Errors
/// When what is there is no file of keys, has a key of that name, or cannot be replaced.
pub fn add_to_file(path: &Path, key: &Key) -> Result<(), KeyFileError> {
    change(path, |text| {
        let gap = if text.is_empty() || text.ends_with("\n\n") { "" } else { "\n" };
        Ok(format!("{text}{gap}{}", to_toml(key)))
    })
}

/// Takes a key out of a file, with its former secret: from the server's next look on nobody gets in with it.
///
/// # Errors
/// When there is no such key, or the file cannot be read or replaced. The last key stays: a server does without keys
/// only where its settings say so.
pub fn revoke_in_file(path: &Path, name: &KeyName) -> Result<(), KeyFileError> {
    change(path, |text| {
        let mut file = document(path, text)?;
        let tables = tables_of(&mut file);
        let place = tables.iter().position(|table| is_of(table, name)).ok_or_else(|| unknown(path, name))?;
        if tables.len() == 1 {
            return Err(KeyFileError::Empty(path.to_owned()));
        }
        tables.remove(place);
        Ok(file.to_string())
    })
}

/// Gives a key another secret. The one before counts until `former_expires`, so that its holders may change one after
/// the other; without that it ends at once.
///
/// # Errors
/// When there is no such key, its last rotation is not over and the former secret is to go on, or the file cannot be
/// read or replaced.
pub fn rotate_in_file(
    path: &Path,
    name: &KeyName,
    digest: Digest,
    former_expires: Option<Expiry>,
) -> Result<(), KeyFileError> {
    change(path, |text| {
        let mut file = document(path, text)?;
        let tables = tables_of(&mut file);
        let place = tables.iter().position(|table| is_of(table, name));
        let table = place.and_then(|place| tables.get_mut(place)).ok_or_else(|| unknown(path, name))?;
        let former = table.insert("sha256", value(digest.to_string()));
        match (former_expires, former) {
            (Some(expires), Some(former)) => {
                check_rotated(path, name, table)?;
                table.insert("former_sha256", value(former.as_str().unwrap_or_default()));
                let time: Option<toml_edit::Datetime> = expires.to_string().parse().ok();
                table.insert("former_expires", time.map_or(Item::None, value));
            }
            _ => {
                table.remove("former_sha256");
                table.remove("former_expires");
            }
        }
        Ok(file.to_string())
    })
}

/// Refuses to give up a secret that still counts.
fn check_rotated(path: &Path, name: &KeyName, table: &Table) -> Result<(), KeyFileError> {
    if !table.contains_key("former_sha256") {
        return Ok(());
    }
    let until = table.get("former_expires").and_then(Item::as_datetime).map(ToString::to_string);
    match until.as_deref().and_then(Expiry::parse) {
        Some(until) if until.is_past(SystemTime::now()) => Ok(()),
        _ => Err(KeyFileError::Rotating {
            path: path.to_owned(),
            name: name.clone(),
            until: until.unwrap_or_else(|| "it is taken out".into()),
        }),
    }
}

/// Replaces a file by what `make` makes of its text, if that is a file of keys.
fn change(path: &Path, make: impl FnOnce(&str) -> Result<String, KeyFileError>) -> Result<(), KeyFileError> {
    let failed = |error| in_file(path, error);
    // What a link leads to is replaced, not the link.
    let target = &fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let _until_replaced = lock(target).map_err(failed)?;
    let text = match fs::read_to_string(target) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
        text => text.map_err(failed)?,
    };
    let text = make(&text)?;
    parse(path, &text)?;
    replace(target, &text).map_err(failed)
}

/// Waits for its turn to change a file. The lock is one of a file beside it, since the file itself is replaced.
fn lock(path: &Path) -> io::Result<File> {
    let mut name = path.as_os_str().to_owned();
    name.push(".lock");
    let file =
        OpenOptions::new().write(true).create(true).truncate(false).mode(0o600).open(PathBuf::from(name))?;
    // Whatever may change the keys may wait for the lock. Where that cannot be said, only its maker may.
    if let Ok(keys) = fs::metadata(path) {
        let _ = file.set_permissions(keys.permissions());
        let _ = fchown(&file, None, Some(keys.gid()));
    }
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => file.lock()?,
        Err(TryLockError::Error(error)) => return Err(error),
    }
    Ok(file)
}

/// Replaces a file, or makes one for its owner alone. Its readers stay.
fn replace(path: &Path, text: &str) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut new = tempfile::NamedTempFile::new_in(folder)?;
    new.write_all(text.as_bytes())?;
    if let Ok(there) = fs::metadata(path) {
        new.as_file().set_permissions(there.permissions())?;
        // Who may do the one and not the other does what he may.
        let _ = fchown(new.as_file(), None, Some(there.gid()));
        let _ = fchown(new.as_file(), Some(there.uid()), None);
        let made = new.as_file().metadata()?;
        // The server might not be able to read it, and would go on with the keys of before.
        if (made.uid(), made.gid()) != (there.uid(), there.gid()) {
            return Err(io::Error::new(
                io::ErrorKind::PermissionDenied,
                format!(
                    "the file belongs to user {} and group {}, and a new one would belong to {} and {}: nothing was \
                     changed; run this as that user, or as root",
                    there.uid(),
                    there.gid(),
                    made.uid(),
                    made.gid()
                ),
            ));
        }
    }
    new.as_file().sync_all()?;
    new.persist(path)?;
    Ok(())
}

/// A file with its comments; what is no file of keys is refused as reading does.
fn document(path: &Path, text: &str) -> Result<DocumentMut, KeyFileError> {
    if parse(path, text)?.is_empty() {
        return Err(KeyFileError::Empty(path.to_owned()));
    }
    text.parse().map_err(|_| KeyFileError::Form { path: path.to_owned(), line: 1 })
}

/// The tables of keys; inline ones become tables.
fn tables_of(file: &mut DocumentMut) -> &mut ArrayOfTables {
    let keys = file.entry("key").or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
    let tables = std::mem::take(keys).into_array_of_tables().unwrap_or_default();
    *keys = Item::ArrayOfTables(tables);
    keys.as_array_of_tables_mut().expect("it was made one above")
}

fn is_of(table: &Table, name: &KeyName) -> bool {
    table.get("name").and_then(Item::as_str) == Some(name.as_str())
}

fn unknown(path: &Path, name: &KeyName) -> KeyFileError {
    KeyFileError::Unknown { path: path.to_owned(), name: name.clone() }
}
