//! The `mrol` program: its commands, and the demonstration.

mod cli;
mod demo;

use std::process::ExitCode;

use mimalloc::MiMalloc;

/// It asks the system for huge pages, which spares look-ups in big maps a search of page tables each, and gives memory
/// that is free back.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    cli::run()
}
