//! Real and rendered scans, from the folder beside the repository.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod alignment;
mod bare_floats;
mod filter_identity;
mod floor;
mod localization;
mod maps;
#[path = "../support/mod.rs"]
mod support;
