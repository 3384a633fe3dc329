//! The scans of a log in the order of time, each with its guess: what a mapper takes.

mod gravity_window;
mod logged_scan;
mod notes;
mod odometer;
mod options;
mod scan_sequence;

pub use logged_scan::LoggedScan;
pub use odometer::Odometer;
pub use options::SequenceOptions;
pub use scan_sequence::Sequence;
