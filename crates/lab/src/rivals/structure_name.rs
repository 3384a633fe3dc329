//! Names of the structures, by which they are built.

use std::fmt::{self, Display};

use super::dense::{Dense, DenseTooLarge};
use super::hash_set::HashSet;
use super::ours::{Kernel, ThroughMap};
use super::paper::PaperFilter;
use super::structure::Structure;
use mrol_map::map::{Lookup, MultiResolutionMap};

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Order, Room, Site, Workload};
    use clap::ValueEnum;
    use mrol_map::geometry::Point;
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
