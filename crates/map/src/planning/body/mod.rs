//! Bodies, what is asked about: links of spheres and points, their poses, and how they move.

mod body_of_links;
mod configurations;
mod cover;
mod in_cells;
mod parts;
mod path;
mod placed;
mod placement;
mod prepared;
mod reach;

pub use body_of_links::Body;
pub(super) use configurations::MAP_FRAME;
pub use configurations::{Configurations, NUMBERS_PER_POSE};
pub use cover::{COVER_SPHERES_MAX, CoverError, cover_box, cover_capsule};
pub(super) use in_cells::{BodyInCells, Group, LinkInCells, POINTS_PER_CLUMP};
pub(super) use parts::RADIUS_MAX_M;
pub use parts::{Link, Sphere};
pub(super) use path::LinkMotion;
pub use placed::PlacedPart;
pub(super) use placement::{CellsFromLink, EightTransforms, LinkPose};
pub(super) use reach::Reach;
