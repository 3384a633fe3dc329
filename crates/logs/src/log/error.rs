//! Why a log cannot be read, or not to its end.

use std::io;

/// Why a log cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file is no log of this format.
    #[error("this is no MCAP file: it begins with {0:02x?}")]
    NoMcap(Vec<u8>),
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Where and why a log was not read to its end: what came before is good.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the log is good up to byte {at}: {why}")]
pub struct Damage {
    /// First byte that was not used.
    pub at: u64,
    /// Why.
    pub why: DamageKind,
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
    /// A record that is not as the format says.
    #[error("the {0} there is not as the format says")]
    Format(&'static str),
}
