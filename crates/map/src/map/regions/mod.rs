//! Parts of space that a caller names.

mod cell_box;
mod distance;
mod error;
mod frustum;
mod oriented_box;
mod region;
mod voxel_selection;

pub use cell_box::CellBox;
pub use error::{REGION_M_MAX, RegionError};
pub use frustum::{Frustum, FrustumError};
pub use oriented_box::OrientedBox;
pub use region::Region;
pub use voxel_selection::VoxelSelection;
