//! Mapping in this process, without a server, and what is said about the result.

mod ample;
mod map_grid;
mod mapper;
mod truth_errors;

pub use ample::{FalsePositives, FilterSummary};
pub use map_grid::grid_of;
pub use mapper::{KnownScan, Mapped, Mapper};
pub use truth_errors::{ErrorSummary, TruthErrors};
