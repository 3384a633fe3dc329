//! Check of a data folder while no server uses it: reads every file, and checks that they agree.

mod diagnose;
mod diagnosis;
mod replay;
mod set_aside;
#[cfg(test)]
mod tests;

pub use diagnose::{diagnose, diagnose_file};
pub use diagnosis::{AsideFile, Diagnosis};
pub use set_aside::{SetAside, set_aside, set_file_aside};
