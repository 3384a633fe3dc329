//! The `mrol` program.

fn main() {}
