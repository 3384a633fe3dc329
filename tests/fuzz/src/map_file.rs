//! Map files, as `mrol restore` takes them from anybody.

use mrol::store::Snapshot;

use super::{frames, map_state};

/// Bytes of a body, at most.
const BODY_BYTES_MAX: u64 = 1 << 16;

/// A `Snapshot` of `proto/mrol/store/v1/snapshot.proto` in a good frame, or, where it begins as one, a whole file.
pub(super) fn map_file(bytes: &[u8]) {
    let framed = frames::map_file(bytes);
    let file = if bytes.starts_with(b"MROL-MAP") { bytes } else { &framed };
    match Snapshot::decode_within(file, BODY_BYTES_MAX) {
        Ok(snapshot) => {
            if let Ok(map) = snapshot.restore() {
                map_state::check(&map, bytes);
            }
        }
        Err(reason) => assert!(!reason.is_empty()),
    }
}
