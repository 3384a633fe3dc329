//! The critical path of everything (paper II): rotate, translate, quantize, look up.
//!
//! One operation: points and a pose in, a bit a point out. `scalar` defines it; the SIMD variants agree with it
//! bit for bit and are chosen at run time.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod by_key;
mod scalar;
#[cfg(test)]
mod tests;

pub use by_key::filter_contains;

use super::OccupiedVoxelList;
use super::sharding::SHARDS;
use crate::bloom::CountingBloomFilter;
use crate::geometry::Point;
use crate::util::Keyword;
#[cfg(target_arch = "x86_64")]
use crate::util::cpu::{Avx2, Avx512};
use crate::voxel::{LatticeFromPoints, Slots};

/// Which of the two structures of a level answers (paper II).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lookup {
    /// The exact set.
    #[default]
    Exact,
    /// The counting Bloom filter alone: now and then "occupied" of a free voxel, never "free" of an occupied one. The exact
    /// set in a map without filters.
    Bloom,
}

impl Keyword for Lookup {
    const ALL: &'static [Self] = &[Self::Exact, Self::Bloom];

    fn as_str(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Bloom => "bloom",
        }
    }
}

/// What a look-up at one level reads: plain slices, shard by shard.
#[derive(Debug, Clone)]
pub struct LevelView<'a> {
    /// Bit planes of the level's filters.
    planes: [&'a [u64]; SHARDS],
    /// Slots of the tables that serve the level.
    blocks: [Slots<'a>; SHARDS],
    /// Hash functions of the filters; 0 where there are none.
    hashes: u32,
    level: u32,
    /// How many levels up in its block a voxel of the level is.
    up: u32,
    /// From an index of the level to its region.
    region_shift: u32,
}

impl<'a> LevelView<'a> {
    /// A view of the lists that `list` gives, whose filters have so many `hashes`; a shard without one is read as empty.
    pub(super) fn new(
        level: u32,
        up: u32,
        region_shift: u32,
        hashes: Option<u32>,
        list: impl Fn(usize) -> Option<OccupiedVoxelList<'a>>,
    ) -> Self {
        const NO_PLANE: &[u64] = &[0];
        let filter = |i| list(i).and_then(|list| list.filter());
        Self {
            planes: std::array::from_fn(|i| filter(i).map_or(NO_PLANE, CountingBloomFilter::plane)),
            blocks: std::array::from_fn(|i| list(i).map_or(Slots::NONE, |list| list.blocks().slots())),
            hashes: hashes.unwrap_or(0),
            level,
            up,
            region_shift,
        }
    }
}

impl LevelView<'_> {
    /// The structure that answers such a look-up.
    fn answering(&self, lookup: Lookup) -> Lookup {
        if self.hashes == 0 { Lookup::Exact } else { lookup }
    }

    /// Bytes that look-ups of this kind may read.
    fn bytes(&self, lookup: Lookup) -> usize {
        match lookup {
            Lookup::Bloom => self.planes.iter().map(|plane| size_of_val(*plane)).sum(),
            Lookup::Exact => self.blocks.iter().map(|slots| slots.mask_bytes).sum(),
        }
    }
}

/// Points that [`count`] looks up at a time: their bits fit in a cache line or two.
const COUNT_CHUNK: usize = 2048;

/// Says of each point whether its voxel is occupied: point i is bit i % 64 of `occupied[i / 64]`, and bits past
/// the last point are zero. True when every point has a voxel; one that has none is not occupied.
///
/// # Panics
/// When `occupied` is not one word for each 64 points.
pub(super) fn occupied(
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

/// [`occupied`] as CPUs without SIMD instructions run it: the reference implementation.
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
pub(super) fn count(
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
