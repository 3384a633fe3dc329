//! The look-up of points: which structure answers, and with which kernel.

use super::level_view::{LevelView, Lookup};
use super::scalar;
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};
use crate::geometry::Point;
#[cfg(target_arch = "x86_64")]
use crate::util::cpu::{Avx2, Avx512};
use crate::voxel::LatticeFromPoints;

/// Points that [`count`] looks up at a time: their bits fit in a cache line or two.
const COUNT_CHUNK: usize = 2048;

/// Says of each point whether its voxel is occupied: point i is bit i % 64 of `occupied[i / 64]`, and bits past
/// the last point are zero. True when every point has a voxel; one that has none is not occupied.
///
/// # Panics
/// When `occupied` is not one word for each 64 points.
pub(in crate::map) fn occupied(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    assert_eq!(occupied.len(), points.len().div_ceil(64), "one word of answers for each 64 points");
    match view.answering(lookup) {
        Lookup::Bloom => look_up(points, lattice_from_points, view, lookup, occupied),
        Lookup::Exact => exactly(points, lattice_from_points, view, occupied),
    }
}

/// Points that tell an exact look-up which way to take, and points for which it then keeps to it.
const EXACT_CHUNKS: (usize, usize) = (512, 16_384);
const _: () = assert!(EXACT_CHUNKS.0.is_multiple_of(64) && EXACT_CHUNKS.1.is_multiple_of(64));
/// One point in so many is occupied, at most, where asking the filter first pays.
const SPARSE: usize = 8;

/// Exact look-up (paper II: the filter, then the set for what it lets through). Where most points are occupied the
/// filter lets them all through and only costs; so each chunk goes the way that suited the one before it.
fn exactly(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    occupied: &mut [u64],
) -> bool {
    let (mut all_have_a_voxel, mut sparse) = (true, false);
    let (first, later) = points.split_at(EXACT_CHUNKS.0.min(points.len()));
    let (first_words, later_words) = occupied.split_at_mut(first.len().div_ceil(64));
    let chunks = later.chunks(EXACT_CHUNKS.1).zip(later_words.chunks_mut(EXACT_CHUNKS.1 / 64));
    for (points, words) in std::iter::once((first, first_words)).chain(chunks) {
        if sparse {
            all_have_a_voxel &= look_up(points, lattice_from_points, view, Lookup::Bloom, words);
            scalar::confirm(points, lattice_from_points, view, words);
        } else {
            all_have_a_voxel &= look_up(points, lattice_from_points, view, Lookup::Exact, words);
        }
        let hits: u32 = words.iter().map(|word| word.count_ones()).sum();
        sparse = hits as usize * SPARSE < points.len() && view.hashes > 0;
    }
    all_have_a_voxel
}

/// Asks one structure, with the widest kernel that the machine has.
fn look_up(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx512::detect() {
        return avx512::occupied(cpu, points, lattice_from_points, view, lookup, occupied);
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx2::detect() {
        return avx2::occupied(cpu, points, lattice_from_points, view, lookup, occupied);
    }
    scalar::occupied(points, lattice_from_points, view, lookup, occupied)
}

/// `occupied` as CPUs without SIMD instructions run it: the reference implementation.
///
/// # Panics
/// As there.
pub fn occupied_scalar(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    assert_eq!(occupied.len(), points.len().div_ceil(64), "one word of answers for each 64 points");
    scalar::occupied(points, lattice_from_points, view, view.answering(lookup), occupied)
}

/// Number of points whose voxel is occupied.
pub(in crate::map) fn count(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
) -> usize {
    let mut bits = [0; COUNT_CHUNK / 64];
    let counts = points.chunks(COUNT_CHUNK).map(|chunk| {
        let bits = &mut bits[..chunk.len().div_ceil(64)];
        occupied(chunk, lattice_from_points, view, lookup, bits);
        bits.iter().map(|word| word.count_ones() as usize).sum::<usize>()
    });
    counts.sum()
}
