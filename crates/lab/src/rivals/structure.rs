//! [`Structure`]: what a rival answers, and what those by key have in common.

use mrol_map::geometry::{Point, Pose};
use mrol_map::map::MapView;
use mrol_map::voxel::{LatticeFromPoints, VoxelKey, quantize};

/// A structure of occupied voxels of one level.
pub trait Structure {
    /// Looks up whether the voxel of each point is occupied: point i is bit i % 64 of `occupied[i / 64]`, which has a
    /// word for each 64 points. A point without a voxel is not occupied.
    fn occupied(&self, points: &[Point], map_from_points: &Pose, occupied: &mut [u64]);

    /// Bytes of memory of the structure.
    fn bytes(&self) -> usize;
}

/// Points that are transformed at a time; their keys stay in the innermost cache.
pub(super) const CHUNK: usize = 1024;
const _: () = assert!(CHUNK.is_multiple_of(64), "a chunk's answers are whole words");

/// Keys of the occupied voxels of `level`.
pub(super) fn voxels<'a>(view: &'a MapView<'_>, level: u32) -> impl Iterator<Item = VoxelKey> + 'a {
    view.lists(level).flat_map(|list| list.iter())
}

/// Looks up points by key, chunk by chunk: transforms the points, then calls `contains` with each key. `contains` must
/// be false for [`quantize::NO_KEY`].
#[inline(always)]
pub(super) fn occupied_by_key(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    level: u32,
    occupied: &mut [u64],
    contains: impl Fn(u64) -> bool,
) {
    let mut keys = [0; CHUNK];
    for (points, words) in points.chunks(CHUNK).zip(occupied.chunks_mut(CHUNK / 64)) {
        let keys = &mut keys[..points.len()];
        quantize::keys(points, lattice_from_points, level, keys);
        bits(keys, words, |&key| contains(key));
    }
}

/// Counts the points whose key is contained; see [`occupied_by_key`].
#[inline(always)]
pub(super) fn count_by_key(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    level: u32,
    contains: impl Fn(u64) -> bool,
) -> usize {
    let mut keys = [0; CHUNK];
    let count = |points: &[Point]| {
        let keys = &mut keys[..points.len()];
        quantize::keys(points, lattice_from_points, level, keys);
        keys.iter().filter(|&&key| contains(key)).count()
    };
    points.chunks(CHUNK).map(count).sum()
}

/// Writes a bit for each item: item i is bit i % 64 of `words[i / 64]`.
#[inline(always)]
pub(crate) fn bits<T>(items: &[T], words: &mut [u64], is_set: impl Fn(&T) -> bool) {
    for (items, word) in items.chunks(64).zip(words) {
        *word = (0..).zip(items).fold(0, |word, (bit, item)| word | u64::from(is_set(item)) << bit);
    }
}
