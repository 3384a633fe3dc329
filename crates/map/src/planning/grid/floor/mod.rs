//! The floor that robots stand on: the surfaces below the poses from which a map was seen, and what can be driven to
//! from there.
//!
//! ```text
//! voxels -> surfaces -> regions, spread from below each pose -> the floor: a height for each column
//! ```

mod find;
mod height;
mod regions;
mod surfaces;

pub use find::find_floor;
pub use height::Floor;
pub(super) use height::Height;
