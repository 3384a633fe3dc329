//! What commands say and read: output for people and for programs, errors with their exit codes, values of options.
//!
//! The commands of `mrol`, the demonstration and the program of the lab share it, and how the daemon is run.

mod credentials;
pub mod error;
pub mod map_report;
mod new_file;
pub mod output;
pub mod parse;
mod plan;
mod points;
mod poses_by_time;
pub mod runtime;
mod scan_reader;
mod serve;
mod serving;
pub mod statistics;
mod survey;
pub mod truth;

pub use map_report::{MapReport, bytes, count, percent};
pub use statistics::Statistics;
pub use truth::{poses_of_scans, true_poses};

pub use self::credentials::CredentialOptions;
pub use self::error::CliError;
pub use self::new_file::{NewFile, check_is_no_input, place_of_map_file};
pub use self::output::Output;
pub use self::plan::{PlanLayer, plan};
pub use self::points::points_of;
pub use self::scan_reader::ScanReader;
pub use self::serve::{Serve, ServeOptions};
pub use self::serving::Serving;
pub use self::survey::{OriginChoice, Survey};
