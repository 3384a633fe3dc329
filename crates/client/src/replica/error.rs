//! Errors of a replica.

use std::time::Duration;

use crate::error::ClientError;
use mrol_map::map::ContentHash;
use mrol_service::ServiceError;

/// Why a replica fails.
#[derive(Debug, thiserror::Error)]
pub enum ReplicaError {
    /// The server refused, or could not be reached.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// What the server sent makes no sense.
    #[error("the server's messages are damaged: {0}")]
    Damaged(String),
    /// The copy holds other voxels than the map at the same revision, as after an older data folder was put back. It is
    /// copied anew.
    #[error(
        "the copy differs from the map at revision {revision}: its content hash is {copy}, the map's {map}; the server goes on \
         from an older data folder than the copy was made of. The whole map is copied again"
    )]
    Diverged {
        /// The revision of both.
        revision: u64,
        /// The content hash of the copy.
        copy: ContentHash,
        /// The content hash of the map, as the server told it.
        map: ContentHash,
    },
    /// The server sent nothing for so long, not even a heartbeat.
    #[error("the server was silent for {0:?}, silence_max of the replica")]
    Silent(Duration),
    /// The map has more blocks than the replica may have.
    #[error("the map has more than blocks_max, {0}, blocks: copy a region, or raise blocks_max")]
    TooLarge(usize),
    /// The map has more viewpoints than the replica may have.
    #[error(
        "the map's viewpoints take more than viewpoint_bytes_max, {0} bytes: raise it, or set it to 0 to copy none"
    )]
    TooManyViewpoints(usize),
    /// The question cannot be answered.
    #[error("{0}")]
    Question(#[from] ServiceError),
}
