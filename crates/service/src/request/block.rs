//! Blocks of a map, for planners that look into it themselves.

use super::version::MapVersion;
use super::watch::BlockBytes;
use mrol_map::map::{DistanceBlock, Region};

/// What does a part of the map hold?
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockRequest {
    /// 0 is the finest.
    pub level: u32,
    /// In which form, and of which part.
    pub form: BlockForm,
}

/// In which form a block is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BlockForm {
    /// The occupied voxels as masks: those whose centers lie in a region, or all.
    Sparse {
        /// The region.
        region: Option<Region>,
    },
    /// The distance of each cell whose center lies in a box of finite sides.
    Dense {
        /// The box: [`Region::Box`].
        region: Region,
        /// Distances need not be told beyond this, meters; without, beyond 63.75 cells.
        cap_m: Option<f64>,
    },
}

/// A block of a map, at one revision.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockAnswer {
    /// The level.
    pub level: u32,
    /// The side of its voxels, meters.
    pub resolution_m: f64,
    /// What it holds.
    pub voxels: BlockVoxels,
    /// At this state.
    pub version: MapVersion,
}

/// What a block holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BlockVoxels {
    /// The occupied voxels; blocks without one are left out.
    Sparse(BlockBytes),
    /// The distance of each cell from the nearest occupied voxel.
    Dense(DistanceBlock),
}
