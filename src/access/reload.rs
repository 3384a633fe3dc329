//! What is read from files and may change while the server runs: keys, certificates.

use std::fs;
use std::fs::Metadata;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use parking_lot::{Mutex, RwLock};

/// A value made of files. When they change it is made anew; where that fails, the former value stays in force.
///
/// Files are looked at, not watched: a look is a few system calls a second, and sees whatever way a file came to be
/// replaced (written in place, renamed over, the target of a link exchanged, another file system mounted there).
pub struct ReloadableFile<T, E> {
    files: Vec<PathBuf>,
    make: Make<T, E>,
    current: RwLock<Arc<T>>,
    seen: Mutex<Seen>,
}

/// Makes the value, from the one in force where there is one.
type Make<T, E> = Box<dyn Fn(Option<&T>) -> Result<T, E> + Send + Sync>;

/// The files as they were when they were last read, and what was wrong with them.
struct Seen {
    files: Vec<Option<Appearance>>,
    failure: Option<String>,
}

/// What changes when a file is changed or replaced.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Appearance {
    modified: Option<SystemTime>,
    bytes: u64,
    inode: u64,
}

/// What came of another look at the files.
#[derive(Debug, PartialEq, Eq)]
pub enum Reload<E> {
    /// The files are as they were.
    Unchanged,
    /// The value is new.
    Anew,
    /// The files cannot be used, for a reason that was not told before; the former value stays.
    Refused(E),
}

impl<T, E: ToString> ReloadableFile<T, E> {
    /// The value that `make` makes of `files`.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn new(
        files: Vec<PathBuf>,
        make: impl Fn(Option<&T>) -> Result<T, E> + Send + Sync + 'static,
    ) -> Result<Self, E> {
        // Looked at before they are read: a change in between is seen the next time.
        let seen = Seen { files: appearances(&files), failure: None };
        let current = RwLock::new(Arc::new(make(None)?));
        Ok(Self { files, make: Box::new(make), current, seen: Mutex::new(seen) })
    }

    /// The value in force.
    pub fn current(&self) -> Arc<T> {
        Arc::clone(&self.current.read())
    }

    /// Makes the value anew if a file has changed. One that was refused is tried again each time, since it may have
    /// been half written.
    pub fn refresh(&self) -> Reload<E> {
        let mut seen = self.seen.lock();
        if seen.failure.is_none() && seen.files == appearances(&self.files) {
            return Reload::Unchanged;
        }
        self.read_again(&mut seen)
    }

    /// Makes the value anew, whatever the files look like.
    pub fn reload(&self) -> Reload<E> {
        let mut seen = self.seen.lock();
        seen.failure = None;
        self.read_again(&mut seen)
    }

    fn read_again(&self, seen: &mut Seen) -> Reload<E> {
        seen.files = appearances(&self.files);
        match (self.make)(Some(&self.current())) {
            Ok(value) => {
                *self.current.write() = Arc::new(value);
                seen.failure = None;
                Reload::Anew
            }
            Err(error) => match seen.failure.replace(error.to_string()) {
                told if told == seen.failure => Reload::Unchanged,
                _ => Reload::Refused(error),
            },
        }
    }
}

impl<T, E> std::fmt::Debug for ReloadableFile<T, E> {
    /// The value may be secret.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ReloadableFile").field("files", &self.files).finish_non_exhaustive()
    }
}

/// True where everybody on the machine may read or write a file: not for what is secret.
pub fn is_open_to_others(file: &Path) -> bool {
    fs::metadata(file).is_ok_and(|file| file.permissions().mode() & 0o006 != 0)
}

fn appearances(files: &[PathBuf]) -> Vec<Option<Appearance>> {
    files.iter().map(|file| fs::metadata(file).ok().map(|file| appearance(&file))).collect()
}

fn appearance(file: &Metadata) -> Appearance {
    Appearance { modified: file.modified().ok(), bytes: file.len(), inode: file.ino() }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Number = ReloadableFile<u32, String>;

    fn number_in(file: &Path) -> Result<Number, String> {
        let path = file.to_owned();
        let make = move |_: Option<&u32>| {
            let text = fs::read_to_string(&path).map_err(|error| error.to_string())?;
            text.parse().map_err(|_| format!("{text:?} is no number"))
        };
        ReloadableFile::new(vec![file.to_owned()], make)
    }

    /// Replaces a file as an administrator's tool does.
    fn replace(file: &Path, text: &str) {
        let new = file.with_extension("new");
        fs::write(&new, text).unwrap();
        fs::rename(new, file).unwrap();
    }

    #[test]
    fn a_file_that_is_replaced_is_read_again_and_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("number");
        fs::write(&file, "1").unwrap();
        let number = number_in(&file).unwrap();
        assert_eq!((*number.current(), number.refresh()), (1, Reload::Unchanged));
        replace(&file, "2");
        assert_eq!((number.refresh(), *number.current()), (Reload::Anew, 2));
        assert_eq!(number.refresh(), Reload::Unchanged);
        assert_eq!(number.reload(), Reload::Anew);
    }

    #[test]
    fn a_file_for_everybody_is_told_from_one_for_a_group() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for (mode, open) in [(0o600, false), (0o640, false), (0o644, true), (0o602, true)] {
            fs::set_permissions(file.path(), fs::Permissions::from_mode(mode)).unwrap();
            assert_eq!(is_open_to_others(file.path()), open, "{mode:o}");
        }
    }

    #[test]
    fn a_file_that_is_broken_or_gone_leaves_the_value_and_is_told_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("number");
        assert!(number_in(&file).is_err());
        fs::write(&file, "1").unwrap();
        let number = number_in(&file).unwrap();
        replace(&file, "one");
        assert_eq!(number.refresh(), Reload::Refused("\"one\" is no number".into()));
        assert_eq!((number.refresh(), *number.current()), (Reload::Unchanged, 1));
        fs::remove_file(&file).unwrap();
        assert!(matches!(number.refresh(), Reload::Refused(_)));
        replace(&file, "3");
        assert_eq!((number.refresh(), *number.current()), (Reload::Anew, 3));
    }
}
