//! Files that commands write: whole, or not at all.

use std::fmt::Display;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempPath;

use super::error::CliError;

/// A file that is written under a name of its own beside its place, and put there once it is whole.
///
/// So whoever reads it never finds a part, and what stood there before stays if the disk is full or the command is
/// stopped. What is no regular file, such as a pipe or /dev/stdout, is written where it is.
#[derive(Debug)]
pub struct NewFile {
    /// As the user named it.
    named: PathBuf,
    /// Where it is to be.
    place: PathBuf,
    /// Where it is written; none where that is its place.
    beside: Option<TempPath>,
}

impl NewFile {
    /// A file that is to be at `path`.
    ///
    /// # Errors
    /// When its folder is not there or cannot be written to.
    pub fn at(path: &Path) -> Result<Self, CliError> {
        let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let is_special = fs::metadata(&place).is_ok_and(|there| !there.is_file());
        let beside = if is_special { None } else { Some(beside(&place).map_err(CliError::writing(path))?) };
        Ok(Self { named: path.to_owned(), place, beside })
    }

    /// Where it is to be written.
    pub fn path(&self) -> &Path {
        self.beside.as_deref().unwrap_or(&self.place)
    }

    /// The error of a file that cannot be written, by the name that the user gave it.
    pub fn failed(&self, problem: impl Display) -> CliError {
        CliError::failed(format!("{}: cannot be written: {problem}", self.named.display()))
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// When something else is there that it cannot replace.
    pub fn keep(self) -> Result<(), CliError> {
        let Self { named, place, beside } = self;
        match beside {
            Some(beside) => beside.persist(&place).map_err(|kept| CliError::writing(&named)(kept.error)),
            None => Ok(()),
        }
    }
}

/// A new file in the folder of `place`, with the rights that any new file has.
fn beside(place: &Path) -> io::Result<TempPath> {
    let folder = place.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".mrol-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    Ok(builder.tempfile_in(folder)?.into_temp_path())
}

/// Checks that a file that is to be written is none of those that are read.
///
/// # Errors
/// Names the file.
pub fn check_is_no_input<'a>(out: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<(), CliError> {
    let Ok(place) = fs::canonicalize(out) else { return Ok(()) };
    let is_input = |input: &Path| fs::canonicalize(input).is_ok_and(|input| input == place);
    match inputs.into_iter().any(is_input) {
        true => {
            let out = out.display();
            Err(CliError::usage(format!("{out} is to be read, and would be replaced: write another file")))
        }
        false => Ok(()),
    }
}

/// Where a map file is to be that the user wants at `out`: the end of a link.
///
/// # Errors
/// When its name does not say that it is a map file, so that none replaces a file of another kind, or something else
/// than a file is there: a map file is put in the place of what is there.
pub fn place_of_map_file(out: &Path) -> Result<PathBuf, CliError> {
    let named = out.display();
    if !out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mrol")) {
        return Err(CliError::usage(format!("--out: a map file's name must end in .mrol, got {named}")));
    }
    let place = fs::canonicalize(out).unwrap_or_else(|_| out.to_owned());
    match fs::metadata(&place).is_ok_and(|there| !there.is_file()) {
        true => Err(CliError::usage(format!("--out: {named} is no regular file, which a map file replaces"))),
        false => Ok(place),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_there_once_it_is_whole_and_what_was_there_stays_until_then() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        let names = || fs::read_dir(folder.path()).unwrap().count();
        fs::write(&path, "before").unwrap();
        let cancelled = NewFile::at(&path).unwrap();
        fs::write(cancelled.path(), "a par").unwrap();
        assert!(cancelled.failed("full").to_string().contains("a.ply: cannot be written: full"));
        drop(cancelled);
        assert_eq!((fs::read(&path).unwrap(), names()), (b"before".to_vec(), 1));
        let kept = NewFile::at(&path).unwrap();
        fs::write(kept.path(), "after").unwrap();
        kept.keep().unwrap();
        assert_eq!((fs::read(&path).unwrap(), names()), (b"after".to_vec(), 1));
        assert!(NewFile::at(&folder.path().join("none/a.ply")).is_err());
        let null = NewFile::at(Path::new("/dev/null")).unwrap();
        assert_eq!(null.path(), Path::new("/dev/null"));
        null.keep().unwrap();
    }

    #[test]
    fn a_file_that_is_read_is_not_replaced_whatever_it_is_called() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("a.ply"), "").unwrap();
        let (read, other) = (path("a.ply"), folder.path().join("./a.ply"));
        let error = check_is_no_input(&other, [path("b.ply").as_path(), &read]).unwrap_err();
        assert!(error.to_string().contains("would be replaced"), "{error}");
        check_is_no_input(&path("new.ply"), [read.as_path()]).unwrap();
        assert_eq!(place_of_map_file(&path("new.mrol")).unwrap(), path("new.mrol"));
        for none in [Path::new("/dev/null"), &read] {
            assert!(place_of_map_file(none).unwrap_err().to_string().contains("must end in .mrol"));
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_map_file_takes_the_place_of_a_file_and_of_the_end_of_a_link_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("real.mrol"), "").unwrap();
        std::os::unix::fs::symlink("real.mrol", path("link.mrol")).unwrap();
        std::os::unix::fs::symlink("/dev/null", path("null.mrol")).unwrap();
        assert_eq!(
            place_of_map_file(&path("link.mrol")).unwrap(),
            fs::canonicalize(path("real.mrol")).unwrap()
        );
        let refused = place_of_map_file(&path("null.mrol")).unwrap_err().to_string();
        assert!(refused.contains("null.mrol is no regular file"), "{refused}");
    }
}
