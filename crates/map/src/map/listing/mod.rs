//! Listings: the voxels of one level, all of them or a selection, as keys or as blocks of 8 x 8 x 8.

mod cell_bounds;
mod level_block;
mod level_blocks;
mod level_voxels;
mod selected;

pub(crate) use cell_bounds::CellBounds;
pub use level_blocks::{BlockParts, blocks_in};
pub use level_voxels::LevelVoxels;
