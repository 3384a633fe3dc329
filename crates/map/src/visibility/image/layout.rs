//! How many bytes of a range image tell what.

use super::tile::TILE_BYTES;
use crate::visibility::directions::CubeMap;

/// Bytes of an image before its tiles: how many there are along a side, the unit of depths, and how the rays lay.
pub(super) const HEAD_BYTES: usize = 1 + 3 * 4;

/// Bytes of an image with `kept` tiles where it is stored.
pub(super) fn stored_bytes(map: CubeMap, kept: usize) -> usize {
    HEAD_BYTES + map.tiles_of_all_faces().div_ceil(8) + kept * TILE_BYTES
}

/// Tiles that an image of at most `bytes` bytes can keep.
pub(in crate::visibility) fn tiles_max(map: CubeMap, bytes: usize) -> usize {
    bytes.saturating_sub(stored_bytes(map, 0)) / TILE_BYTES
}
