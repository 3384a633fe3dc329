//! What a server acknowledged, and what others saw of it.

use std::collections::BTreeMap;
use std::time::Instant;

use parking_lot::Mutex;

use super::error::FleetError;
use super::tally::Tally;
use mrol_map::map::ContentHash;
use mrol_service::MapVersion;

/// The revisions that a server acknowledged, each with the hash of what the map held then, and when.
#[derive(Debug, Default)]
pub(crate) struct Ledger(Mutex<BTreeMap<u64, (ContentHash, Instant)>>);

/// A revision as somebody else saw it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sighting {
    pub(crate) revision: u64,
    /// Hash of what the copy held.
    pub(crate) hash: ContentHash,
    pub(crate) at: Instant,
}

impl Ledger {
    /// Writes down an acknowledgement that came now.
    pub(crate) fn note(&self, version: &MapVersion) {
        if let Some(hash) = version.content_hash {
            self.0.lock().insert(version.revision, (hash, Instant::now()));
        }
    }

    /// The last revision that was acknowledged; 0 without one.
    pub(crate) fn head(&self) -> u64 {
        self.0.lock().last_key_value().map_or(0, |(revision, _)| *revision)
    }

    /// Compares hashes of the revisions that are in the ledger: an operation of the tally is a comparison, an error a
    /// difference, and its time how much later it was seen than acknowledged; 0 where it was seen first.
    pub(crate) fn compare(&self, seen: &[Sighting]) -> Result<Tally, FleetError> {
        let (acknowledged, mut tally) = (self.0.lock(), Tally::new()?);
        for Sighting { revision, hash, at } in seen {
            if let Some((told, when)) = acknowledged.get(revision) {
                let differs = || format!("the hash of revision {revision} is {hash}, and the map's {told}");
                tally.count(at.saturating_duration_since(*when), (hash != told).then(differs));
            }
        }
        Ok(tally)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use mrol_map::voxel::{VoxelKey, VoxelSet};

    fn hash(x: i32) -> ContentHash {
        ContentHash::of(&[VoxelKey::new([x, 0, 0]).unwrap()].into_iter().collect::<VoxelSet>())
    }

    #[test]
    fn a_difference_is_counted_and_what_was_not_acknowledged_is_not_compared() {
        let ledger = Ledger::default();
        for revision in [4, 5] {
            let content_hash = Some(hash(revision as i32));
            ledger.note(&MapVersion { revision, map_uuid: uuid::Uuid::nil(), content_hash });
        }
        assert_eq!(ledger.head(), 5);
        let at = Instant::now() + Duration::from_millis(80);
        let seen = [(4, 4), (5, 4), (6, 6)].map(|(revision, of)| Sighting { revision, hash: hash(of), at });
        let tally = ledger.compare(&seen).unwrap();
        assert_eq!((tally.operations(), tally.error_count()), (2, 1));
        assert!((70.0..=80.5).contains(&tally.quantile_ms(0.5)), "{}", tally.quantile_ms(0.5));
    }
}
