//! Map files, as `mrol restore` takes them from anybody.

use mrol_store::{MapFileLimits, Snapshot};

use super::{frames, map_state};

/// So small that reaching them costs little.
const LIMITS: MapFileLimits = MapFileLimits {
    body_bytes_max: 1 << 16,
    voxels_max: 1 << 20,
    scans_max: 100,
    viewpoint_bytes_max: 1 << 20,
};
/// Memory that reading a file may ask for: what it asks for is what it takes, and the address sanitizer sees when it is
/// not.
const MEMORY_MAX: u64 = 16 << 20;

/// A `Snapshot` of `proto/mrol/store/v1/snapshot.proto` in a good frame, or, where it begins as one, a whole file.
pub(super) fn map_file(bytes: &[u8]) {
    let framed = frames::map_file(bytes);
    let file = if bytes.starts_with(b"MROL-MAP") { bytes } else { &framed };
    let mut memory = 0;
    let reserve = |bytes| {
        memory += bytes;
        if memory > MEMORY_MAX { Err("no memory") } else { Ok(()) }
    };
    match Snapshot::decode_within(file, &LIMITS, reserve) {
        Ok(snapshot) => {
            // The target's own memory is bounded too; a server reserves that of the filters before it builds them.
            let (settings, voxels) = (&snapshot.settings, &snapshot.contents.voxels);
            if settings.first_filter_bytes() + settings.filter_bytes_of(voxels) > MEMORY_MAX {
                return;
            }
            if let Ok(map) = snapshot.restore() {
                map_state::check(&map, bytes);
            }
        }
        Err(refusal) => assert!(!refusal.to_string().is_empty()),
    }
}
