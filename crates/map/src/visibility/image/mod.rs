//! A range image that is kept: how far a scan saw in each direction, in 8 kB, and what it is asked.

mod bytes;
mod layout;
mod range_image;
mod sight;
mod tile;

pub use bytes::RangeImageError;
pub(super) use layout::tiles_max;
pub use range_image::{AbsenceEvidence, IMAGE_BYTES_MAX, Met, RangeImage};
pub(super) use range_image::{DEPTH_MAX, NOT_SEEN, RaySpacing};
pub use sight::Sight;
pub(super) use sight::sight;
pub(super) use tile::{TILE_PIXELS, Tile};
