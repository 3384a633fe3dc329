//! Reports: results as plots and tables in files.

pub mod chart;
mod error;
mod spread;
mod table;

pub use error::ReportError;
pub use spread::Spread;
pub use table::{Table, folder};
