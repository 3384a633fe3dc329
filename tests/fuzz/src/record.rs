//! A record of the journal whose checksums are right and whose content is anything.

use super::{journal, map_state};

/// A `Change` of `proto/mrol/store/v1/records.proto`: replayed, or refused.
pub(super) fn record(bytes: &[u8]) {
    if let Ok(opened) = journal::with_record(bytes) {
        map_state::check(&opened.map, bytes);
    }
}
