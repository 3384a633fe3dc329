//! Answers about bodies: what one meets first, and how much room it has.

use crate::map::KeepOutName;
use crate::voxel::{Lattice, VoxelKey};

/// Largest distance up to which clearances are told, in voxels of the level that is asked.
pub const CLEARANCE_CELLS_MAX: f64 = 64.0;

/// The largest distance up to which clearances are told at `level`, meters.
pub fn clearance_max_m(lattice: &Lattice, level: u32) -> f32 {
    let voxels_m = CLEARANCE_CELLS_MAX * lattice.resolution_m(level);
    // The largest float that is not more.
    let rounded = voxels_m as f32;
    if f64::from(rounded) > voxels_m { rounded.next_down() } else { rounded }
}

/// What something meets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Met {
    /// A voxel: for a sphere the nearest to its center, of several the one with the smallest key; for a point without
    /// padding the one that it falls in.
    Voxel(VoxelKey),
    /// A keep-out, by its name: the nearest to the center, of several as near the first by name.
    KeepOut(KeepOutName),
}

impl Met {
    /// The voxel, where it is one.
    pub fn voxel(&self) -> Option<VoxelKey> {
        match self {
            Self::Voxel(voxel) => Some(*voxel),
            Self::KeepOut(_) => None,
        }
    }

    /// The keep-out, where it is one.
    pub fn keep_out(&self) -> Option<&KeepOutName> {
        match self {
            Self::Voxel(_) => None,
            Self::KeepOut(name) => Some(name),
        }
    }
}

/// What a body meets first: in the order of links, in a link spheres before points, each in their order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hit {
    /// The link.
    pub link: u32,
    /// The sphere, or the number of spheres plus that of the point.
    pub part: u32,
    /// What it meets; the voxel where it meets one and a keep-out.
    pub met: Met,
}

/// How much room a body has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearance {
    /// Distance from the body to the nearest voxel, meters: 0 where they meet, and at most what was asked for.
    pub distance_m: f32,
    /// The link that is nearest, the first of several; none where nothing is nearer than what was asked for.
    pub link: Option<u32>,
}
