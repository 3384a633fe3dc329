//! A base as it is written at NATS: a map file, and where in the log it stands.

use mrol_map::map::StateHash;
use mrol_service::replication::{Base, NodeName, Position};
use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// A base as JSON.
#[derive(Serialize, Deserialize)]
struct Written {
    sequence: u64,
    id: Option<Uuid>,
    epoch: u64,
    leader: Option<String>,
    revision: u64,
    state: Option<String>,
    checksum: Option<u32>,
}

/// Name of the file of this map: `UUID/REVISION-SEQUENCE`.
pub(super) fn object_of(base: &Base, map: Uuid) -> String {
    format!("{map}/{}-{}", base.revision, base.position.sequence)
}

pub(super) fn to_json(base: &Base) -> serde_json::Result<Vec<u8>> {
    let Base { position: Position { sequence, id }, epoch, leader, revision, state, checksum } = base.clone();
    let (leader, state) = (leader.map(|node| node.to_string()), state.map(|state| state.to_string()));
    serde_json::to_vec(&Written { sequence, id, epoch, leader, revision, state, checksum })
}

pub(super) fn from_json(text: &[u8]) -> Result<Base, String> {
    let written: Written = serde_json::from_slice(text).map_err(|error| error.to_string())?;
    let Written { sequence, id, epoch, leader, revision, state, checksum } = written;
    let leader = leader.map(|node| NodeName::new(&node).map_err(|error| error.to_string())).transpose()?;
    let bits =
        |state: String| u64::from_str_radix(&state, 16).map_err(|error| format!("state {state:?}: {error}"));
    let state = state.map(bits).transpose()?.map(StateHash::from_bits);
    Ok(Base { position: Position { sequence, id }, epoch, leader, revision, state, checksum })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_is_read_as_it_was_written() {
        let position = Position { sequence: 7, id: Some(Uuid::from_u128(9)) };
        let leader = Some(NodeName::new("a").unwrap());
        let state = Some(StateHash::from_bits(0xabc));
        let base = Base { position, epoch: 2, leader, revision: 30, state, checksum: Some(5) };
        assert_eq!(from_json(&to_json(&base).unwrap()), Ok(base.clone()));
        assert_eq!(object_of(&base, Uuid::nil()), "00000000-0000-0000-0000-000000000000/30-7");
        assert_eq!(from_json(&to_json(&Base::default()).unwrap()), Ok(Base::default()));
        assert!(from_json(b"{}").is_err());
    }
}
