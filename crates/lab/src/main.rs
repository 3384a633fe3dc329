//! The `mrol-lab` program; see [`mrol_lab::cli`].

use std::process::ExitCode;

use mimalloc::MiMalloc;

/// As in `mrol`: what is measured here is what runs there.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    mrol_lab::cli::run()
}
