//! A log as users have it: a file, or the files of a folder one after another.

use std::collections::BTreeMap;
use std::fmt::{self, Debug, Formatter};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use super::error::{Damage, LogError};
use super::mcap::McapReader;
use super::message::Topic;
use super::messages::Messages;
use mrol_map::scan::compare_names;
use mrol_map::util::excerpt;

/// Bytes that are read from a file at once.
const BUFFER_BYTES: usize = 1 << 18;
/// Binary logarithm of the bytes that zstd looks back at most, 128 MiB: what `zstd --long` asks for.
const ZSTD_WINDOW_LOG_MAX: u32 = 27;

/// Endings of files of logs.
pub const ENDINGS: [&str; 4] = [".mcap", ".db3", ".mcap.zstd", ".db3.zstd"];
/// What is added to the name of a file that was compressed.
const COMPRESSED: &str = ".zstd";

/// The messages of a log: of a file, or of the files of a folder one after another, in the natural order of their
/// names.
///
/// A recorder that splits its log numbers the files. Of a file that was compressed, and is there as it was before too,
/// the latter is read. Topics of the same name, type and encoding are one.
pub struct Bag {
    /// Files that were not begun.
    files: std::vec::IntoIter<BagFile>,
    /// The file that is read; none at the end.
    current: Option<Current>,
    /// Numbers of the topics of all files.
    numbers: BTreeMap<Topic, usize>,
    topics: Vec<Topic>,
    damages: Vec<Damage>,
    /// Bytes of the files that were read to their end.
    position: u64,
    bytes: u64,
}

/// A file of a log.
#[derive(Debug)]
struct BagFile {
    path: PathBuf,
    bytes: u64,
    /// Its name, where there are others.
    name: Option<String>,
}

/// A file of a log that is read.
struct Current {
    messages: Box<dyn Messages + Send>,
    file: BagFile,
    /// Numbers of its topics among those of all files.
    numbers: Vec<usize>,
}

impl Bag {
    /// The log that is a file, or a folder.
    ///
    /// # Errors
    /// When it cannot be read, or is none.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let metadata = std::fs::metadata(path)?;
        let files = match metadata.is_dir() {
            true => files_of_folder(path)?,
            // Whoever opens a named pipe waits for its writer.
            false if !metadata.is_file() => return Err(LogError::NotAFile(excerpt(&path.to_string_lossy()))),
            false => vec![BagFile { path: path.to_owned(), bytes: metadata.len(), name: None }],
        };
        let bytes = files.iter().map(|file| file.bytes).sum();
        let mut bag = Self {
            files: files.into_iter(),
            current: None,
            numbers: BTreeMap::new(),
            topics: Vec::new(),
            damages: Vec::new(),
            position: 0,
            bytes,
        };
        bag.open_next()?;
        Ok(bag)
    }

    /// True of a path that is a log by its name, or a folder by the names in it.
    pub fn is_log(path: &Path) -> bool {
        match std::fs::read_dir(path) {
            Ok(entries) => entries.flatten().any(|entry| has_ending(&entry.path())),
            Err(_) => has_ending(path),
        }
    }

    /// Bytes of all files.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Goes on with the next file, where there is one.
    fn open_next(&mut self) -> Result<(), LogError> {
        self.current = None;
        if let Some(file) = self.files.next() {
            let messages = messages_of(&file.path).map_err(|error| match &file.name {
                Some(name) => LogError::InFile { name: name.clone(), error: Box::new(error) },
                None => error,
            })?;
            self.current = Some(Current { messages, file, numbers: Vec::new() });
        }
        Ok(())
    }
}

impl Messages for Bag {
    fn advance(&mut self) -> Result<Option<(usize, u64)>, LogError> {
        while let Some(current) = &mut self.current {
            if let Some((topic, log_time_ns)) = current.messages.advance()? {
                for new in &current.messages.topics()[current.numbers.len()..] {
                    let number = *self.numbers.entry(new.clone()).or_insert_with(|| {
                        self.topics.push(new.clone());
                        self.topics.len() - 1
                    });
                    current.numbers.push(number);
                }
                return Ok(Some((current.numbers[topic], log_time_ns)));
            }
            let damages = current.messages.damages().iter().cloned();
            self.damages.extend(damages.map(|damage| Damage { file: current.file.name.clone(), ..damage }));
            self.position += current.file.bytes;
            self.open_next()?;
        }
        Ok(None)
    }

    fn data(&self) -> &[u8] {
        self.current.as_ref().map_or(&[], |current| current.messages.data())
    }

    fn topics(&self) -> &[Topic] {
        &self.topics
    }

    fn position(&self) -> u64 {
        let of_current = |current: &Current| current.messages.position().min(current.file.bytes);
        self.position + self.current.as_ref().map_or(0, of_current)
    }

    fn damages(&self) -> &[Damage] {
        &self.damages
    }
}

impl Debug for Bag {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let file = self.current.as_ref().map(|current| &current.file);
        f.debug_struct("Bag").field("file", &file).field("position", &self.position()).finish_non_exhaustive()
    }
}

/// The files of a log in a folder, in the natural order of their names.
fn files_of_folder(folder: &Path) -> Result<Vec<BagFile>, LogError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let (path, name) = (entry.path(), excerpt(&entry.file_name().to_string_lossy()));
        if !has_ending(&path) {
            continue;
        }
        if entry.file_type()?.is_symlink() {
            return Err(LogError::Link(name));
        }
        if !entry.file_type()?.is_file() {
            return Err(LogError::NotAFile(name));
        }
        if is_compressed(&path) && path.with_extension("").exists() {
            continue;
        }
        files.push(BagFile { path, bytes: entry.metadata()?.len(), name: Some(name) });
    }
    files.sort_by(|a, b| compare_names(&a.path, &b.path));
    if files.is_empty() { Err(LogError::NoFile { endings: ENDINGS.join(" ") }) } else { Ok(files) }
}

fn has_ending(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    ENDINGS.iter().any(|ending| name.ends_with(ending))
}

fn is_compressed(path: &Path) -> bool {
    path.to_string_lossy().to_ascii_lowercase().ends_with(COMPRESSED)
}

/// How a database of SQLite begins.
#[cfg(feature = "sqlite")]
const DATABASE_BEGIN: &[u8] = b"SQLite format 3\0";
/// How many times as large a database may be as it is compressed: clouds shrink to a tenth.
#[cfg(feature = "sqlite")]
const UNPACKED_MAX: u64 = 1000;

/// The messages of a file, by its ending: without one that is known, it is taken for MCAP.
fn messages_of(path: &Path) -> Result<Box<dyn Messages + Send>, LogError> {
    let inner = if is_compressed(path) { path.with_extension("") } else { path.to_owned() };
    if inner.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("db3")) {
        return messages_of_database(path);
    }
    let file = BufReader::with_capacity(BUFFER_BYTES, File::open(path)?);
    Ok(match is_compressed(path) {
        true => Box::new(McapReader::new(BufReader::with_capacity(BUFFER_BYTES, decompressed(file)?))?),
        false => Box::new(McapReader::new(file)?),
    })
}

/// What a compressed file has in it.
fn decompressed<R: std::io::BufRead>(file: R) -> Result<impl Read, LogError> {
    let mut decoder = zstd::stream::read::Decoder::with_buffer(file)?;
    decoder.window_log_max(ZSTD_WINDOW_LOG_MAX)?;
    Ok(decoder)
}

/// The messages of a database; one that was compressed is put into a temporary file first.
#[cfg(feature = "sqlite")]
fn messages_of_database(path: &Path) -> Result<Box<dyn Messages + Send>, LogError> {
    use super::sqlite::DatabaseReader;

    if !is_compressed(path) {
        return Ok(Box::new(DatabaseReader::open(path)?));
    }
    let file = File::open(path)?;
    let compressed_bytes = file.metadata()?.len();
    let mut database = decompressed(BufReader::with_capacity(BUFFER_BYTES, file))?;
    // What is no database is not unpacked, and neither is what would fill a disk.
    let mut begin = Vec::new();
    (&mut database).take(DATABASE_BEGIN.len() as u64).read_to_end(&mut begin)?;
    if begin != DATABASE_BEGIN {
        return Err(LogError::NoBag(format!("what is compressed in it begins with {begin:02x?}")));
    }
    let bytes_max = compressed_bytes.saturating_mul(UNPACKED_MAX);
    let mut unpacked = tempfile::Builder::new().prefix("mrol-log-").suffix(".db3").tempfile()?;
    let copied = std::io::copy(&mut (&begin[..]).chain(database).take(bytes_max + 1), &mut unpacked)?;
    if copied > bytes_max {
        return Err(LogError::NoBag(format!(
            "its {compressed_bytes} bytes unpack to more than {UNPACKED_MAX} times as many: if that is right, unpack it by \
             `zstd -d` and give the .db3"
        )));
    }
    Ok(Box::new(DatabaseReader::open_unpacked(unpacked)?))
}

#[cfg(not(feature = "sqlite"))]
fn messages_of_database(_: &Path) -> Result<Box<dyn Messages + Send>, LogError> {
    Err(LogError::NoDatabases)
}
