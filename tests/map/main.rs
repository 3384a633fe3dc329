//! The map and what is found in it, without a server: histories, alignment, localization, growth.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

#[cfg(feature = "lab")]
mod alignment_verdicts;
#[cfg(feature = "lab")]
mod localization;
#[cfg(feature = "client")]
mod map_history;
#[cfg(feature = "lab")]
mod recovery;
mod stationary_robots;
#[path = "../support/mod.rs"]
mod support;
mod trajectory_growth;
mod viewpoints;
#[cfg(feature = "lab")]
mod without_moments;
