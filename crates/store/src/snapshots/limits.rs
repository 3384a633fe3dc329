//! Limits on map files, and why one is refused.

use crate::codec::Unreadable;

/// Limits on the contents of a map file. The error of a file beyond one names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapFileLimits {
    /// Most bytes of the body before compression.
    pub body_bytes_max: u64,
    /// Most finest voxels, and most blocks of them.
    pub voxels_max: usize,
    /// Most scans of the trajectory, and most withdrawn scans.
    pub scans_max: usize,
    /// Most bytes of memory of the viewpoints.
    pub viewpoint_bytes_max: usize,
}

impl MapFileLimits {
    /// Limits of files that are known to be a server's own: bodies beyond 8 GiB, 4 billion voxels of a surface, are
    /// refused.
    pub const OWN: Self = Self {
        body_bytes_max: 8 << 30,
        voxels_max: usize::MAX,
        scans_max: usize::MAX,
        viewpoint_bytes_max: usize::MAX,
    };
}

/// Why a map file was not read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MapFileError<E> {
    /// The file is not a map file, is damaged, or was written by a newer version.
    #[error("{0}")]
    Bad(Unreadable),
    /// The file holds more than a limit allows.
    #[error("the map file has {count} {what}, {limit} is {most}")]
    TooLarge {
        /// What the file has too much of.
        what: &'static str,
        /// Count in the file.
        count: usize,
        /// Name of the limit.
        limit: &'static str,
        /// Value of the limit.
        most: usize,
    },
    /// Memory for the contents was refused.
    #[error("{0}")]
    NoMemory(E),
    /// Reading was stopped: the caller cancelled it, or its time is up.
    #[error("the reading of the map file was stopped")]
    Stopped,
}

impl<E> From<Unreadable> for MapFileError<E> {
    fn from(reason: Unreadable) -> Self {
        Self::Bad(reason)
    }
}

/// Callback that reserves memory for the next part of a map file, when all parts before it exist.
pub(super) struct Memory<F>(pub(super) F);

impl<F> Memory<F> {
    /// # Errors
    /// When the memory is refused.
    pub(super) fn reserve<E>(&mut self, bytes: usize) -> Result<(), MapFileError<E>>
    where
        F: FnMut(u64) -> Result<(), E>,
    {
        (self.0)(bytes as u64).map_err(MapFileError::NoMemory)
    }
}
