//! Real and rendered scans, from the folder beside the repository.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

#[cfg(feature = "server")]
mod alignment;
#[cfg(feature = "lab")]
mod filter_identity;
mod localization;
mod maps;
#[path = "../support/mod.rs"]
mod support;
