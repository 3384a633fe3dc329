//! What a map file may hold, and why one is not read.

use crate::store::codec::Unreadable;

/// Bounds on what is read of a map file. Each is named in the refusal of a file beyond it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapFileLimits {
    /// Bytes of the body before compression.
    pub body_bytes_max: u64,
    /// Finest voxels, and blocks of them.
    pub voxels_max: usize,
    /// Scans of the trajectory, and as many that were taken out again.
    pub scans_max: usize,
}

impl MapFileLimits {
    /// Limits of files that are known to be a server's own: bodies beyond 8 GiB, 4 billion voxels of a surface, are
    /// refused.
    pub const OWN: Self = Self { body_bytes_max: 8 << 30, voxels_max: usize::MAX, scans_max: usize::MAX };
}

/// Why a map file was not read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MapFileError<E> {
    /// The file is no map file, is damaged, or was written by a newer version.
    #[error("{0}")]
    Bad(Unreadable),
    /// The file holds more than a limit allows.
    #[error("the map file has {count} {what}, {limit} is {most}")]
    TooLarge {
        /// What it has too much of.
        what: &'static str,
        /// How much.
        count: usize,
        /// The limit's name.
        limit: &'static str,
        /// The limit.
        most: usize,
    },
    /// There is no memory for what it holds.
    #[error("{0}")]
    NoMemory(E),
    /// Nobody waits for it any more, or its time is up.
    #[error("the reading of the map file was stopped")]
    Stopped,
}

impl<E> From<Unreadable> for MapFileError<E> {
    fn from(reason: Unreadable) -> Self {
        Self::Bad(reason)
    }
}

/// Memory for what is read of a map file, asked for a part at a time: what was asked for before is there by then.
pub(super) struct Memory<F>(pub(super) F);

impl<F> Memory<F> {
    /// # Errors
    /// When there is none.
    pub(super) fn reserve<E>(&mut self, bytes: usize) -> Result<(), MapFileError<E>>
    where
        F: FnMut(u64) -> Result<(), E>,
    {
        (self.0)(bytes as u64).map_err(MapFileError::NoMemory)
    }
}
