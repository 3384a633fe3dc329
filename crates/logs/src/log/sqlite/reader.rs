//! The messages of a database, in the order in which they were written.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io::Read;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Error, ErrorCode, OpenFlags, OptionalExtension};
use tempfile::NamedTempFile;

use crate::log::error::{Damage, DamageKind, LogError, Place};
use crate::log::message::{Topic, is_name};
use crate::log::messages::Messages;

/// Bytes of a message, and of one that is decompressed, at most.
pub const MESSAGE_BYTES_MAX: usize = 64 << 20;
/// Topics of a database, at most: as many as a file of MCAP has channels.
const TOPICS_MAX: usize = 1 << 16;
/// How a message begins that was compressed by zstd; those in CDR begin with a 0.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// Binary logarithm of the bytes that zstd looks back at most, 32 MiB.
const ZSTD_WINDOW_LOG_MAX: u32 = 25;

const TABLES: &str =
    "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name IN ('topics', 'messages')";
/// Columns whose values are computed, of which a small file may have as many as it likes.
const COMPUTED: &str = "SELECT count(*) FROM (SELECT hidden FROM pragma_table_xinfo('topics') UNION ALL \
                        SELECT hidden FROM pragma_table_xinfo('messages')) WHERE hidden <> 0";
const TOPICS: &str = "SELECT id, name, type, serialization_format FROM topics ORDER BY rowid";
const NEXT: &str =
    "SELECT rowid, topic_id, timestamp, data FROM messages WHERE rowid > ?1 ORDER BY rowid LIMIT 1";
const FIRST_AND_LAST: &str = "SELECT min(rowid), max(rowid) FROM messages";

/// Reads the messages of a database that ROS 2 recorded.
#[derive(Debug)]
pub struct DatabaseReader {
    database: Connection,
    /// Bytes of the file.
    bytes: u64,
    /// Number of the first and of the last row.
    rows: (i64, i64),
    /// Number of the row that was read last.
    row: i64,
    /// The message that was read last.
    data: Vec<u8>,
    /// Numbers in `topics` by those in the database.
    numbers: BTreeMap<i64, usize>,
    topics: Vec<Topic>,
    damage: Option<Damage>,
}

impl DatabaseReader {
    /// A reader of a file, at its begin.
    ///
    /// # Errors
    /// When it cannot be read, or is no database of ROS 2.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let bytes = std::fs::metadata(path)?.len();
        let no_bag = |error: Error| LogError::NoBag(error.to_string());
        let (database, tables) = match connect(path.as_os_str().as_bytes()) {
            // What a recorder left beside the file takes a folder that can be written to.
            Err(error) if is_unwritable(&error) => {
                let beside = PathBuf::from([path.as_os_str(), OsStr::new("-wal")].join(OsStr::new("")));
                if std::fs::metadata(&beside).is_ok_and(|beside| beside.len() > 0) {
                    return Err(LogError::NoBag(format!(
                        "its last messages are in {}, which is read in folders alone that can be written to: copy the \
                         folder, and read the copy",
                        beside.display()
                    )));
                }
                connect(&uri_of_unchanging(path)).map_err(no_bag)?
            }
            connected => connected.map_err(no_bag)?,
        };
        if tables != 2 {
            return Err(LogError::NoBag("it has no tables `topics` and `messages`".to_owned()));
        }
        let computed: i64 = database.query_row(COMPUTED, [], |row| row.get(0)).map_err(no_bag)?;
        if computed != 0 {
            return Err(LogError::NoBag(
                "columns of its tables are computed, where those of ROS 2 are stored".to_owned(),
            ));
        }
        let rows: (Option<i64>, Option<i64>) =
            database.query_row(FIRST_AND_LAST, [], |row| Ok((row.get(0)?, row.get(1)?))).map_err(no_bag)?;
        let (numbers, topics) = read_topics(&database).map_err(no_bag)?;
        let rows = (rows.0.unwrap_or(0), rows.1.unwrap_or(0));
        let row = rows.0.saturating_sub(1);
        Ok(Self { database, bytes, rows, row, data: Vec::new(), numbers, topics, damage: None })
    }

    /// A reader of a file that goes with it.
    ///
    /// # Errors
    /// As those of [`DatabaseReader::open`].
    pub(in crate::log) fn open_unpacked(file: NamedTempFile) -> Result<Self, LogError> {
        let path = file.into_temp_path();
        let reader = Self::open(&path)?;
        // The system keeps what is open until nobody has it open, however this process ends.
        path.close()?;
        Ok(reader)
    }

    /// Reads the next row; none at the end. Its topic is none where it is of no topic that is told.
    fn read_row(&mut self) -> Result<Option<(Option<usize>, u64)>, DamageKind> {
        let Self { database, row: last, data, numbers, .. } = self;
        let damaged = |error: Error| DamageKind::Database(error.to_string());
        let mut next = database.prepare_cached(NEXT).map_err(damaged)?;
        let found = next
            .query_row([*last], |row| {
                let content = row.get_ref(3)?;
                data.clear();
                if let ValueRef::Blob(bytes) = content {
                    data.extend_from_slice(bytes);
                }
                Ok((row.get(0)?, row.get::<_, i64>(1)?, row.get::<_, i64>(2)?))
            })
            .optional()
            .map_err(damaged)?;
        let Some((row, topic, time_ns)) = found else { return Ok(None) };
        *last = row;
        if data.starts_with(&ZSTD_MAGIC) {
            *data = decompressed(data)?;
        }
        Ok(Some((numbers.get(&topic).copied(), u64::try_from(time_ns).unwrap_or(0))))
    }
}

impl Messages for DatabaseReader {
    fn advance(&mut self) -> Result<Option<(usize, u64)>, LogError> {
        while self.damage.is_none() {
            match self.read_row() {
                Ok(None) => break,
                Ok(Some((Some(topic), time_ns))) => return Ok(Some((topic, time_ns))),
                Ok(Some((None, _))) => {}
                Err(why) => {
                    let at = Place::Row(self.row.saturating_add(1));
                    self.damage = Some(Damage { file: None, at, why });
                }
            }
        }
        self.data.clear();
        Ok(None)
    }

    fn data(&self) -> &[u8] {
        &self.data
    }

    fn topics(&self) -> &[Topic] {
        &self.topics
    }

    fn position(&self) -> u64 {
        let [first, last, row] = [self.rows.0, self.rows.1, self.row].map(|row| row as f64);
        let share = (row - first + 1.0) / (last - first + 1.0);
        (self.bytes as f64 * share.clamp(0.0, 1.0)) as u64
    }

    fn damages(&self) -> &[Damage] {
        self.damage.as_slice()
    }
}

/// A connection that reads alone, and how many of the tables of a log are there.
fn connect(name: &[u8]) -> Result<(Connection, i64), Error> {
    let flags =
        OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX | OpenFlags::SQLITE_OPEN_URI;
    let database = Connection::open_with_flags(Path::new(OsStr::from_bytes(name)), flags)?;
    database.set_limit(Limit::SQLITE_LIMIT_LENGTH, i32::try_from(MESSAGE_BYTES_MAX).unwrap_or(i32::MAX))?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    let tables = database.query_row(TABLES, [], |row| row.get(0))?;
    Ok((database, tables))
}

/// True where a file cannot be opened since its folder lets nobody write.
fn is_unwritable(error: &Error) -> bool {
    matches!(error.sqlite_error_code(), Some(ErrorCode::CannotOpen | ErrorCode::ReadOnly))
}

/// The name of a file that nobody changes meanwhile.
fn uri_of_unchanging(path: &Path) -> Vec<u8> {
    let mut uri = b"file:".to_vec();
    for &byte in path.as_os_str().as_bytes() {
        match byte {
            b'?' | b'#' | b'%' => uri.extend(format!("%{byte:02x}").into_bytes()),
            _ => uri.push(byte),
        }
    }
    uri.extend(b"?immutable=1");
    uri
}

/// The topics, and their numbers by those in the database.
fn read_topics(database: &Connection) -> Result<(BTreeMap<i64, usize>, Vec<Topic>), Error> {
    let (mut numbers, mut topics) = (BTreeMap::new(), Vec::new());
    let mut statement = database.prepare(TOPICS)?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()?
        && topics.len() < TOPICS_MAX
    {
        let (name, type_name, encoding): (String, String, String) = (row.get(1)?, row.get(2)?, row.get(3)?);
        if [&name, &type_name, &encoding].into_iter().all(|name| is_name(name)) {
            numbers.insert(row.get(0)?, topics.len());
            topics.push(Topic { name, type_name, encoding });
        }
    }
    Ok((numbers, topics))
}

/// A message that was compressed by itself.
fn decompressed(data: &[u8]) -> Result<Vec<u8>, DamageKind> {
    let mut message = Vec::new();
    let read = zstd::stream::read::Decoder::with_buffer(data).and_then(|mut decoder| {
        decoder.window_log_max(ZSTD_WINDOW_LOG_MAX)?;
        decoder.take(MESSAGE_BYTES_MAX as u64 + 1).read_to_end(&mut message)
    });
    read.map_err(|error| DamageKind::Decompression(error.to_string()))?;
    match message.len() {
        len if len > MESSAGE_BYTES_MAX => {
            Err(DamageKind::TooLong { bytes: len as u64, max: MESSAGE_BYTES_MAX })
        }
        _ => Ok(message),
    }
}
