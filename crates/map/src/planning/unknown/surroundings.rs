//! What of the map counts for a question, and what does not.

use crate::map::Region;
use crate::util::Keyword;
use crate::voxel::{Lattice, VoxelKey};

/// What voxels count as that no scan saw through and nothing is known to occupy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Unknown {
    /// As free: only what is known to be there is met.
    #[default]
    Free,
    /// As occupied: a voxel is met unless it is free, seen through where the view has viewpoints and not occupied.
    Occupied,
}

impl Keyword for Unknown {
    const ALL: &'static [Self] = &[Self::Free, Self::Occupied];

    fn as_str(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Occupied => "occupied",
        }
    }
}

/// What a body can run into: the voxels of the map but for those that are ignored, and the keep-outs of
/// a view that has them, wherever they are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surroundings {
    /// Voxels whose centers lie in one of these do not count: an object that is grasped, the robot's own place. Map
    /// frame.
    pub ignored: Vec<Region>,
    /// What unknown voxels count as.
    pub unknown: Unknown,
}

impl Surroundings {
    /// The voxels of the map, all of them.
    pub const ALL_VOXELS: Self = Self { ignored: Vec::new(), unknown: Unknown::Free };

    /// True where unknown voxels count as occupied.
    pub(in crate::planning) fn unknown_counts(&self) -> bool {
        self.unknown == Unknown::Occupied
    }

    /// True where voxels are ignored, so that what is known of the nearest voxel does not tell of the nearest that
    /// counts.
    pub(in crate::planning) fn ignores_some(&self) -> bool {
        !self.ignored.is_empty()
    }

    /// True where `voxel` of `level` does not count.
    pub(in crate::planning) fn ignores(&self, lattice: &Lattice, voxel: VoxelKey, level: u32) -> bool {
        self.ignores_some() && {
            let center_m = lattice.center_m(voxel, level);
            self.ignored.iter().any(|region| region.contains(center_m))
        }
    }
}
