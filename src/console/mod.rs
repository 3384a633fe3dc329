//! What commands say and read: output for people and for programs, errors with their exit codes, values of options.
//!
//! The commands of `mrol`, the demonstration and the program of the lab share it.

pub mod error;
pub mod map_report;
pub mod output;
pub mod parse;
mod plan;
pub mod runtime;
mod serving;
pub mod statistics;
pub mod truth;

pub use error::CliError;
pub use output::Output;
pub use plan::{PlanLayer, plan};
pub use serving::Serving;
