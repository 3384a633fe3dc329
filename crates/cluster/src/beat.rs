//! What a node says of itself every two seconds.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// What a node says of itself every two seconds. What a later version adds, this one leaves out.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Beat {
    /// Address of its HTTP listener, as others reach it: `http://HOST:PORT`.
    pub http: String,
    /// Address of its gRPC listener, likewise.
    pub grpc: String,
    /// Its version, such as `0.2.0`.
    pub version: String,
    /// Version of the records that it reads: a map is led only by who writes what all others read.
    pub record_version: u32,
    /// The maps that it holds, by uuid.
    #[serde(default)]
    pub maps: BTreeMap<Uuid, MapHead>,
    /// Copies that have not joined their logs since the node was started, with their revisions: it takes no changes of
    /// them yet, and may have what a log has lost.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub unjoined: BTreeMap<Uuid, u64>,
    /// Bytes that its disk has left.
    pub free_bytes: u64,
    /// Why the node takes nothing that makes maps grow: `disk_full` or `memory_full`; none where it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_room: Option<String>,
    /// True of the last beat of a node that was told to end: nobody waits for it.
    #[serde(default)]
    pub has_ended: bool,
}

/// How far a node's copy of a map is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct MapHead {
    /// Revision of its last change.
    pub revision: u64,
    /// How many claims of its log the node has read.
    pub epoch: u64,
    /// The id of the last claim that it has read, where it has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub claim: Option<Uuid>,
    /// Number of the last message of its log that the node has read.
    #[serde(default)]
    pub sequence: u64,
    /// True where the node makes the map's changes.
    #[serde(default)]
    pub leads: bool,
    /// True where the node takes no changes of the map any more: it has another history than the log, or its disk
    /// failed.
    #[serde(default)]
    pub is_parted: bool,
    /// False where the node cannot tell whether its history is the log's: it goes on from nothing that it has.
    #[serde(default = "yes")]
    pub agrees: bool,
}

fn yes() -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beat_is_read_as_it_was_written_and_by_versions_that_know_less() {
        let maps = BTreeMap::from([(
            Uuid::from_u128(7),
            MapHead {
                revision: 12,
                epoch: 3,
                claim: Some(Uuid::nil()),
                sequence: 14,
                leads: true,
                is_parted: false,
                agrees: true,
            },
        )]);
        let beat = Beat {
            http: "http://a:7333".to_owned(),
            grpc: "http://a:7334".to_owned(),
            version: "0.2.0".to_owned(),
            record_version: 5,
            maps,
            unjoined: BTreeMap::from([(Uuid::from_u128(8), 3)]),
            free_bytes: 1 << 40,
            no_room: None,
            has_ended: false,
        };
        let text = serde_json::to_string(&beat).unwrap();
        assert_eq!(serde_json::from_str::<Beat>(&text).unwrap(), beat);
        let later = text.replacen('{', "{\"mood\":\"good\",", 1);
        assert_eq!(serde_json::from_str::<Beat>(&later).unwrap(), beat);
    }
}
