//! Errors of reading scan and trajectory files.

use std::io;
use std::path::{Path, PathBuf};

use super::supported::FILE_BYTES_MAX;

/// Longest piece of a file that a message repeats, characters.
const QUOTE_CHARS_MAX: usize = 80;
/// Longest message, characters; parsers from elsewhere may repeat whole lines of a file.
const PROBLEM_CHARS_MAX: usize = 500;

/// Why a scan or trajectory file could not be read; every message starts with the file.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file or directory could not be opened or read.
    #[error("{path}: {cause}")]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// What the operating system said.
        cause: io::Error,
    },
    /// No reader knows the file's extension.
    #[error("{path}: unsupported extension {extension:?}, supported are {}", supported.join(" "))]
    Extension {
        /// The file.
        path: PathBuf,
        /// The file's extension without the dot; empty when it has none.
        extension: String,
        /// The extensions that are read, with their dots.
        supported: &'static [&'static str],
    },
    /// The file is larger than a scan may be.
    #[error("{path}: larger than {FILE_BYTES_MAX} bytes, the most a scan file may have; split it")]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// What is there is a pipe, a socket or a device, which may have no end.
    #[error("{path}: {what}, and a scan is read from a regular file alone: write it to a file first")]
    NotAFile {
        /// The path.
        path: PathBuf,
        /// What is there: a named pipe, for example.
        what: &'static str,
    },
    /// A directory has no scan file.
    #[error("{path}: no scan file in this directory, supported are {}", supported.join(" "))]
    Empty {
        /// The directory.
        path: PathBuf,
        /// The extensions that are read, with their dots.
        supported: &'static [&'static str],
    },
    /// A line of text could not be understood.
    #[error("{path}:{line}: {problem}")]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What was wrong with it.
        problem: String,
    },
    /// The content is not what its format asks for.
    #[error("{path}: {problem}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What was wrong, at which byte or element.
        problem: String,
    },
}

impl ReadError {
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |cause| Self::Io { path, cause }
    }
}

/// A problem of a file's content, before the file's name is known.
#[derive(Debug)]
pub(in crate::scan) struct Problem {
    line: Option<usize>,
    text: String,
}

impl Problem {
    /// A problem of the whole content, or one whose place is in `text`.
    pub(in crate::scan) fn new(text: impl Into<String>) -> Self {
        Self { line: None, text: shortened(text.into(), PROBLEM_CHARS_MAX) }
    }

    /// A problem of `line`, counted from 1.
    pub(in crate::scan) fn at_line(line: usize, text: impl Into<String>) -> Self {
        Self { line: Some(line), ..Self::new(text) }
    }

    /// The [`ReadError`] of this problem in the file at `path`.
    pub(in crate::scan) fn in_file(self, path: &Path) -> ReadError {
        let (path, problem) = (path.to_owned(), self.text);
        match self.line {
            Some(line) => ReadError::Line { path, line, problem },
            None => ReadError::Content { path, problem },
        }
    }
}

/// `text` in quotes, shortened, so that a hostile file cannot write a gigabyte into a log.
pub(in crate::scan) fn quoted(text: &str) -> String {
    match text.char_indices().nth(QUOTE_CHARS_MAX) {
        Some((end, _)) => format!("{:?}...", &text[..end]),
        None => format!("{text:?}"),
    }
}

fn shortened(mut text: String, chars_max: usize) -> String {
    if let Some((end, _)) = text.char_indices().nth(chars_max) {
        text.truncate(end);
        text.push_str("...");
    }
    text
}
