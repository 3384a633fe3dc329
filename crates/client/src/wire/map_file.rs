//! Map files in pieces (`maps.proto`).

use bytes::Bytes;

use super::pb;
use mrol_map::map::MapName;
use mrol_service::MapFile;

/// Bytes of a piece.
const PIECE_BYTES: usize = 1 << 20;

/// Bytes of memory that a file of so many bytes takes until its last message is sent: itself, and a message, written
/// with room for twice as much.
pub fn snapshot_bytes(file_bytes: usize) -> usize {
    file_bytes + 2 * file_bytes.min(PIECE_BYTES)
}

/// A file as messages.
pub fn snapshot_pieces(file: MapFile) -> impl Iterator<Item = pb::SnapshotMapResponse> + Send {
    let MapFile { bytes, version } = file;
    let file_bytes = bytes.len() as u64;
    pieces(bytes).map(move |data| pb::SnapshotMapResponse { data, version: Some(version.into()), file_bytes })
}

/// The messages that make the map `map` of a file, in the place of the one of that name where `replace` says so.
pub fn restore_pieces(
    map: &MapName,
    file: Bytes,
    replace: bool,
) -> impl Iterator<Item = pb::RestoreMapRequest> + Send + use<> {
    let map = map.to_string();
    pieces(file).map(move |data| pb::RestoreMapRequest { map: map.clone(), data, replace })
}

fn pieces(bytes: Bytes) -> impl Iterator<Item = Bytes> + Send {
    let count = bytes.len().div_ceil(PIECE_BYTES).max(1);
    (0..count).map(move |piece| {
        let start = piece * PIECE_BYTES;
        bytes.slice(start..bytes.len().min(start + PIECE_BYTES))
    })
}
