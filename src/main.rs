//! The `mrol` program; see [`mrol::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    mrol::cli::run()
}
