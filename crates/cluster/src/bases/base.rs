//! What is known of a base.

use mrol_map::map::StateHash;
use mrol_service::replication::Position;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// A map file at NATS, and where in the log it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Base {
    /// The last message of the log that the file has in it.
    pub position: Position,
    /// The epoch there.
    pub epoch: u64,
    /// The map's revision there.
    pub revision: u64,
    /// Hash of all that a copy of the map may hold there.
    pub state: StateHash,
}

/// A base as JSON.
#[derive(Serialize, Deserialize)]
struct Written {
    sequence: u64,
    id: Option<Uuid>,
    epoch: u64,
    revision: u64,
    state: String,
}

impl Base {
    /// Name of the file of this map: `UUID/REVISION-SEQUENCE`.
    pub(super) fn object(&self, map: Uuid) -> String {
        format!("{map}/{}-{}", self.revision, self.position.sequence)
    }

    pub(super) fn to_json(&self) -> serde_json::Result<Vec<u8>> {
        let Self { position, epoch, revision, state } = *self;
        let Position { sequence, id } = position;
        serde_json::to_vec(&Written { sequence, id, epoch, revision, state: state.to_string() })
    }

    pub(super) fn from_json(text: &[u8]) -> Result<Self, String> {
        let written: Written = serde_json::from_slice(text).map_err(|error| error.to_string())?;
        let Written { sequence, id, epoch, revision, state } = written;
        let bits = u64::from_str_radix(&state, 16).map_err(|error| format!("state {state:?}: {error}"))?;
        Ok(Self { position: Position { sequence, id }, epoch, revision, state: StateHash::from_bits(bits) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_is_read_as_it_was_written() {
        let position = Position { sequence: 7, id: Some(Uuid::from_u128(9)) };
        let base = Base { position, epoch: 2, revision: 30, state: StateHash::from_bits(0xabc) };
        assert_eq!(Base::from_json(&base.to_json().unwrap()), Ok(base.clone()));
        assert_eq!(base.object(Uuid::nil()), "00000000-0000-0000-0000-000000000000/30-7");
        assert!(Base::from_json(b"{}").is_err());
    }
}
