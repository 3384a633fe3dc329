//! Rivals: structures that answer the same query, "which of these points are in occupied voxels?", from the same points
//! and pose with the same bitmap. All get the fastest transform available, so that only the structure differs.

mod dense;
mod hash_set;
mod hash_tables;
mod ours;
mod paper;
mod weighted_sum;

use std::fmt::{self, Display};

pub use dense::{DENSE_BYTES_MAX, Dense, DenseTooLarge, Grid, offsets};
pub use hash_set::{HashSet, hash_set_bytes};
pub use hash_tables::HashTables;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{Lookup, MapView, MultiResolutionMap};
use mrol_map::voxel::quantize;
use mrol_map::voxel::{LatticeFromPoints, VoxelKey};
pub use ours::{Kernel, ThroughMap, filter_contains, query_scalar};
pub use paper::PaperFilter;
pub use weighted_sum::WeightedSum;

/// Name of a structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum StructureName {
    /// The counting Bloom filters, through the sharded map and its locks
    Bloom,
    /// The exact set, through the sharded map and its locks
    Exact,
    /// The counting Bloom filters, the bare kernel
    BloomKernel,
    /// The exact set, the bare kernel
    ExactKernel,
    /// A hashbrown hash set of packed keys
    Hashset,
    /// An array of a byte a voxel over the bounding box
    Dense,
    /// The paper's filter: 6,000,000 counters, DJB and FNV, modulo
    Paper,
}

impl StructureName {
    /// The name as it is printed.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Bloom => "bloom",
            Self::Exact => "exact",
            Self::BloomKernel => "bloom-kernel",
            Self::ExactKernel => "exact-kernel",
            Self::Hashset => "hashset",
            Self::Dense => "dense",
            Self::Paper => "paper",
        }
    }

    /// True for a structure that never calls a free voxel occupied.
    pub fn is_exact(self) -> bool {
        !matches!(self, Self::Bloom | Self::BloomKernel | Self::Paper)
    }

    /// Builds the structure of the occupied voxels of `level` of a map.
    ///
    /// # Errors
    /// When a dense array would be too large.
    pub fn build<'a>(
        self,
        map: &'a MultiResolutionMap,
        level: u32,
    ) -> Result<Box<dyn Structure + 'a>, DenseTooLarge> {
        Ok(match self {
            Self::Bloom => Box::new(ThroughMap::new(map, level, Lookup::Bloom)),
            Self::Exact => Box::new(ThroughMap::new(map, level, Lookup::Exact)),
            Self::BloomKernel => Box::new(Kernel::new(map, level, Lookup::Bloom)),
            Self::ExactKernel => Box::new(Kernel::new(map, level, Lookup::Exact)),
            Self::Hashset => Box::new(HashSet::of(map, level)),
            Self::Dense => Box::new(Dense::of(map, level)?),
            Self::Paper => Box::new(PaperFilter::of(map, level)),
        })
    }
}

impl Display for StructureName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// A structure of occupied voxels of one level.
pub trait Structure {
    /// Looks up whether the voxel of each point is occupied: point i is bit i % 64 of `occupied[i / 64]`, which has a
    /// word for each 64 points. A point without a voxel is not occupied.
    fn occupied(&self, points: &[Point], map_from_points: &Pose, occupied: &mut [u64]);

    /// Bytes of memory of the structure.
    fn bytes(&self) -> usize;
}

/// Points that are transformed at a time; their keys stay in the innermost cache.
const CHUNK: usize = 1024;
const _: () = assert!(CHUNK.is_multiple_of(64), "a chunk's answers are whole words");

/// Keys of the occupied voxels of `level`.
fn voxels<'a>(view: &'a MapView<'_>, level: u32) -> impl Iterator<Item = VoxelKey> + 'a {
    view.lists(level).flat_map(|list| list.iter())
}

/// Looks up points by key, chunk by chunk: transforms the points, then calls `contains` with each key. `contains` must
/// be false for [`quantize::NO_KEY`].
#[inline(always)]
fn occupied_by_key(
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
fn count_by_key(
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
pub(super) fn bits<T>(items: &[T], words: &mut [u64], is_set: impl Fn(&T) -> bool) {
    for (items, word) in items.chunks(64).zip(words) {
        *word = (0..).zip(items).fold(0, |word, (bit, item)| word | u64::from(is_set(item)) << bit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Order, Room, Site, Workload};
    use clap::ValueEnum;
    use mrol_map::map::MapSettings;

    #[test]
    fn all_structures_give_the_same_answers_but_for_false_positives() {
        for workload in [Workload::Room(Room), Workload::Site(Site::of(20_000, 1))] {
            let map = workload.map(MapSettings::new(workload.resolution_m(), 4)).unwrap();
            // An odd number, and one point in no voxel.
            let mut queries = workload.queries(Order::Scan, 10_001, 1);
            queries.points[77] = Point::new(f32::NAN, 0.0, 0.0);
            for level in [0, 3] {
                let answers = |name: StructureName| {
                    let mut occupied = vec![u64::MAX; queries.points.len().div_ceil(64)];
                    let structure = name.build(&map, level).unwrap();
                    structure.occupied(&queries.points, &queries.map_from_points, &mut occupied);
                    occupied
                };
                let truth = answers(StructureName::ExactKernel);
                for &name in StructureName::value_variants() {
                    let answers = answers(name);
                    let denied = truth.iter().zip(&answers).any(|(truth, answer)| truth & !answer != 0);
                    assert!(!denied, "{name} denies a voxel at level {level}");
                    assert!(!name.is_exact() || answers == truth, "{name} is wrong at level {level}");
                }
            }
        }
    }

    #[test]
    fn a_name_is_printed_as_it_is_given() {
        for name in StructureName::value_variants() {
            assert_eq!(name.to_possible_value().unwrap().get_name(), name.as_str());
        }
    }
}
