//! The command line of the lab: `mrol-lab bench` measures this machine, `mrol-lab experiment` repeats the paper's
//! experiments.
//!
//! Results go to standard output, a line each, as text or (`--json`) as JSON objects; everything else goes to standard
//! error. The exit code is 0 when all went well, 1 when something failed and 2 for a command line that makes no sense.

mod bench;
mod command_line;
mod errors;
mod experiment;
mod sequence;

pub use command_line::run;
