//! Why a log cannot be read, or not to its end.

use std::fmt::{self, Display, Formatter};
use std::io;

/// Why a log cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file is no log of this format.
    #[error(
        "this is no MCAP file: it begins with {0:02x?}. A log is an .mcap or .db3 file, or the folder that `ros2 bag \
         record` made"
    )]
    NoMcap(Vec<u8>),
    /// The file is no database of ROS 2.
    #[error("this is no database of ROS 2: {0}")]
    NoBag(String),
    /// A folder without a file of a log.
    #[error("the folder has no file of a log: {endings} are read")]
    NoFile {
        /// The endings of such files.
        endings: String,
    },
    /// A file among others.
    #[error("{name}: {error}")]
    InFile {
        /// Its name.
        name: String,
        /// What is wrong with it.
        error: Box<LogError>,
    },
    /// A link in a folder.
    #[error(
        "{0} in the folder is a link, and what links lead to is not read: give the folder that has the file"
    )]
    Link(String),
    /// What may have no end.
    #[error("{0} is no regular file: a log is read twice, from its begin")]
    NotAFile(String),
    /// A format that this program was built without.
    #[error(
        "databases are read by programs that were built with the feature `bags`, as the released ones are: \
             in a checkout, `cargo install --path . --features released`; or make MCAP of it by `ros2 bag convert`"
    )]
    NoDatabases,
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Where and why a log was not read to its end: what came before is good.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{} is good up to {at}: {why}", file.as_deref().unwrap_or("the log"))]
pub struct Damage {
    /// The file, where the log has several.
    pub file: Option<String>,
    /// The first that was not used.
    pub at: Place,
    /// Why.
    pub why: DamageKind,
}

/// A place in a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A byte of a file, from 0.
    Byte(u64),
    /// A row of a table.
    Row(i64),
}

impl Display for Place {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(at) => write!(f, "byte {at}"),
            Self::Row(at) => write!(f, "message {at}"),
        }
    }
}

/// Why a log was not read to its end.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DamageKind {
    /// It was cut off, as by a recorder that was killed.
    #[error("it ends there in the middle of a record, as if its recorder was stopped")]
    CutOff,
    /// A record that is longer than any that is read.
    #[error("the record there says it has {bytes} bytes, and {max} are read")]
    TooLong {
        /// Bytes that it claims.
        bytes: u64,
        /// Bytes that are read at once, at most.
        max: usize,
    },
    /// A chunk whose checksum is not that of its content.
    #[error("the checksum of the chunk there is {found:08x}, and it says {claimed:08x}")]
    Checksum {
        /// That of the content.
        found: u32,
        /// That in the chunk.
        claimed: u32,
    },
    /// A compression other than zstd and lz4.
    #[error("the chunk there is compressed by {0:?}, and zstd and lz4 are read")]
    Compression(String),
    /// What cannot be decompressed, or is not as long as it says.
    #[error("the chunk there cannot be decompressed: {0}")]
    Decompression(String),
    /// Bytes behind the end of the log, such as those of another one.
    #[error("the log ends there, and more follows, as if another file was appended: nothing of that is read")]
    Appended,
    /// What SQLite says of a database.
    #[error("{0}")]
    Database(String),
    /// A record that is not as the format says.
    #[error("the {0} there is not as the format says")]
    Format(&'static str),
}
