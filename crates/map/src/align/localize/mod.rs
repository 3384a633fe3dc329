//! Global localization: where in a map a scan was taken, with no guess (the paper's \[8\]).
//!
//! [`localize`] is branch and bound over all poses. The overlap of every pose in a cell of poses is bounded from above
//! by the overlap of the cell's center with a map that is dilated by as much as points move within the cell
//! (`bound`); cells that cannot hold a place worth knowing are left out, the others divided, down to cells from which
//! an alignment finds its way. That is the modern form of what \[8\] does on the levels of this map: a coarse level is
//! such a bound only after dilation, since a point's cube of translations spans up to 2 x 2 x 2 of its voxels and
//! rotations widen that by the arc at the point's range.
//!
//! Reading order: `global_localization` has the composing function; `distance_field` is a dilated level, `dilated` the
//! levels of one revision, `orientation` and `rotation` the rotations, `bound` the bounds, `search` the search;
//! `candidates` and `verdict` judge the places that it finds.

mod answer;
mod basins;
mod bound;
mod candidates;
mod dilated;
mod distance_field;
mod global_localization;
mod normals;
mod orientation;
mod query;
mod rotation;
mod sample;
mod search;
mod settings;
mod slabs;
mod supervision;
#[cfg(test)]
mod tests;
mod verdict;

pub use super::gravity::{Gravity, GravityError, MAP_DOWN};
pub use answer::{Candidate, Localization, LocalizationError, SearchProgress};
pub use global_localization::{localize, localize_supervised};
pub use query::{LocalizationQuery, LocalizationQueryError, SearchBox};
pub use settings::LocalizationSettings;
pub use supervision::Supervision;
