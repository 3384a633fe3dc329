//! State of a replica: its revision, and whether it is connected.

use uuid::Uuid;

use mrol_map::map::ContentVersion;

/// How far a replica is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReplicaStatus {
    /// The map that is copied.
    pub map_uuid: Uuid,
    /// The revision of the copy, with the hash of what it holds: that of the map where all of it is copied.
    pub version: ContentVersion,
    /// The newest revision that the server told of: the copy lags as far behind it.
    pub head_revision: u64,
    /// True while the server is telling of changes.
    pub is_connected: bool,
    /// How often the whole state was copied.
    pub resets: u64,
    /// Why the last watch ended, where it did.
    pub last_error: Option<String>,
    /// True once the replica follows no longer, since the server refused its key again and again: the copy stays as it
    /// is.
    pub has_ended: bool,
}
