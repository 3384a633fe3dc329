//! Questions that planners ask of a map, each at one revision: where rays end, what is nearest, what the map is seen from
//! above.
//!
//! Each question is a function of a [`MapView`](crate::map::MapView) and a request of plain slices, and answers with plain
//! arrays. What is regarded besides voxels asks beside them and keeps the nearer of both answers: the range of a ray and
//! the radius of a search bound what is asked next.

mod grid;
mod nearest;
mod rays;
mod remembered;
#[cfg(test)]
mod test_maps;

pub use grid::{Grid, GridArea, GridError, GridRequest, NotOccupied, project_grid};
pub use nearest::{MeasuredTo, NearestError, NearestRequest, NearestVoxels, RADIUS_VOXELS_MAX, find_nearest};
pub use rays::{DIRECTION_LENGTH_TOLERANCE, RayError, RayHits, Rays, Toward, cast_rays};
