//! The occupied leaves of a tree as voxels of a map.

use std::io::BufRead;

use mrol_map::voxel::{BLOCK_LEVELS, VoxelKey, VoxelSet};

use super::error::OctreeError;
use super::leaf::{CellState, Leaf, cells_of};
use super::reader::OctreeReader;
use crate::collected_voxels::CollectedVoxels;

/// Voxels that are made of a tree, at most: a few bytes of a file claim as many as the tree is large.
pub const VOXELS_MAX: u64 = 1 << 28;
/// Leaves between two reports of progress.
const LEAVES_PER_REPORT: u64 = 1 << 16;

/// What a map takes of a tree.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OctreeVoxels {
    /// The occupied cells, in voxels of the map.
    pub voxels: VoxelSet,
    /// Leaves that are occupied.
    pub occupied: u64,
    /// Leaves that are free.
    pub free: u64,
}

impl OctreeVoxels {
    /// Reads a tree to its end. A voxel is `2^coarser` cells wide, at most 2^15, and occupied where one of its cells
    /// is.
    ///
    /// Calls `progress` now and then with the bytes that were read.
    ///
    /// # Errors
    /// When the file is no tree to its end, or its occupied cells are more than [`VOXELS_MAX`] voxels: this is found
    /// out before they are made.
    pub fn read(
        reader: &mut OctreeReader<impl BufRead>,
        coarser: u32,
        mut progress: impl FnMut(u64),
    ) -> Result<Self, OctreeError> {
        let mut read = Self::default();
        let (mut collected, mut left) = (CollectedVoxels::default(), VOXELS_MAX);
        while let Some(leaf) = reader.next_leaf()? {
            match leaf.state {
                CellState::Free => read.free += 1,
                CellState::Occupied => {
                    read.occupied += 1;
                    let level = leaf.level.saturating_sub(coarser);
                    left = left.checked_sub(cells_of(level)).ok_or(OctreeError::TooManyVoxels(VOXELS_MAX))?;
                    add(&mut collected, leaf, coarser);
                }
            }
            if (read.occupied + read.free) % LEAVES_PER_REPORT == 0 {
                progress(reader.position());
            }
        }
        read.voxels = collected.into_set();
        Ok(read)
    }
}

/// Adds the voxels of a leaf.
fn add(collected: &mut CollectedVoxels, leaf: Leaf, coarser: u32) {
    let level = leaf.level.saturating_sub(coarser);
    // What is coarser than the leaf has it as one of its parts.
    let shift = coarser.saturating_sub(leaf.level);
    let Some(voxel) = VoxelKey::new(leaf.index.map(|i| i >> shift)) else { return };
    match level.checked_sub(BLOCK_LEVELS) {
        None => collected.add_cube(voxel, level),
        Some(above) => collected.add_blocks(voxel, above),
    }
}
