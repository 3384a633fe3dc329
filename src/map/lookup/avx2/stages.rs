//! The stages of a look-up, a batch at a time. All must only be called where [`super::is_available`].

use super::bloom::Planes;
use super::place::Quantizer;
use super::{BATCH, Batch, LANES, LookupKernel, pack, store};
use crate::geometry::Point;
use crate::map::lookup::LevelView;
use crate::map::lookup::stages::{Grid, NO_KEY};
use crate::map::sharding::shard_of_region;
use crate::voxel::{LatticeFromPoints, VoxelKey};

/// See `lookup::stages::keys`.
pub(in crate::map::lookup) fn keys(points: &[Point], t: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    debug_assert!(super::is_available());
    // SAFETY: the caller checked for the feature.
    unsafe { all_keys(points, t, level, keys) }
}

/// See `lookup::stages::offsets`.
pub(in crate::map::lookup) fn offsets(
    points: &[Point],
    t: &LatticeFromPoints,
    level: u32,
    grid: &Grid,
    offsets: &mut [u32],
) {
    debug_assert!(super::is_available());
    // SAFETY: the caller checked for the feature.
    unsafe { all_offsets(points, t, level, grid, offsets) }
}

/// See `lookup::stages::filter_contains`.
pub(in crate::map::lookup) fn filter_contains(keys: &[u64], view: &LevelView<'_>, occupied: &mut [u64]) {
    debug_assert!(super::is_available());
    // SAFETY: the caller checked for the feature.
    unsafe { all_in_filter(keys, view, occupied) }
}

/// # Safety
/// Needs AVX2.
#[target_feature(enable = "avx2")]
unsafe fn all_keys(points: &[Point], t: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    let (place, mut batch, mut packed) = (Quantizer::of_level(t, level, 0), Batch::EMPTY, [0; BATCH]);
    for (points, keys) in points.chunks(BATCH).zip(keys.chunks_mut(BATCH)) {
        // SAFETY: the feature is there.
        let has_voxel = unsafe { place_all(&place, points, &mut batch) };
        for at in (0..BATCH).step_by(4) {
            store(&mut packed[at..], pack(&batch.index, at));
        }
        for ((key, packed), has_voxel) in keys.iter_mut().zip(packed).zip(has_voxel) {
            *key = if has_voxel { packed } else { NO_KEY };
        }
    }
}

/// # Safety
/// Needs AVX2.
#[target_feature(enable = "avx2")]
unsafe fn all_offsets(points: &[Point], t: &LatticeFromPoints, level: u32, grid: &Grid, offsets: &mut [u32]) {
    let (place, mut batch) = (Quantizer::of_level(t, level, 0), Batch::EMPTY);
    for (points, offsets) in points.chunks(BATCH).zip(offsets.chunks_mut(BATCH)) {
        // SAFETY: the feature is there.
        let has_voxel = unsafe { place_all(&place, points, &mut batch) };
        let [x, y, z] = &batch.index;
        for (i, offset) in offsets.iter_mut().enumerate() {
            // Compiles to vector instructions, for none of it is a branch.
            let inside = grid.offset([x[i], y[i], z[i]]);
            *offset = if has_voxel[i] { inside } else { grid.cells() as u32 };
        }
    }
}

/// Writes where a batch of points falls; whether each has a voxel.
///
/// # Safety
/// Needs AVX2.
#[inline]
#[target_feature(enable = "avx2")]
unsafe fn place_all(place: &Quantizer, points: &[Point], batch: &mut Batch) -> [bool; BATCH] {
    let mut has_voxel = [false; BATCH];
    for (group, points) in points.chunks(LANES).enumerate() {
        // SAFETY: the feature is there.
        let valid = unsafe { place.of(points, group * LANES, batch) };
        for (lane, has_voxel) in has_voxel[group * LANES..][..LANES].iter_mut().enumerate() {
            *has_voxel = valid >> lane & 1 == 1;
        }
    }
    has_voxel
}

/// # Safety
/// Needs AVX2.
#[target_feature(enable = "avx2")]
unsafe fn all_in_filter(keys: &[u64], view: &LevelView<'_>, occupied: &mut [u64]) {
    let (planes, mut batch) = (Planes::of(view), Batch::EMPTY);
    for (keys, words) in keys.chunks(BATCH).zip(occupied.chunks_mut(BATCH / 64)) {
        let mut is_key = [0u64; BATCH / 64];
        for (i, &key) in keys.iter().enumerate() {
            let index = VoxelKey::from_bits(key).map_or([0; 3], VoxelKey::index);
            for (axis, index) in batch.index.iter_mut().zip(index) {
                axis[i] = index;
            }
            batch.shard[i] = shard_of_region(index.map(|i| i >> view.region_shift)) as i32;
            is_key[i / 64] |= u64::from(key != NO_KEY) << (i % 64);
        }
        // SAFETY: the feature is there, and the view lives.
        let hits = unsafe { planes.look_up(&batch, keys.len()) };
        words.iter_mut().zip(hits).zip(is_key).for_each(|((word, hits), is_key)| *word = hits & is_key);
    }
}
