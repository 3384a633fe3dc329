//! The map and what is found in it, without a server: histories, alignment, localization, growth.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod alignment_verdicts;
mod localization;
mod localization_scenes;
mod map_history;
mod recovery;
mod stationary_robots;
#[path = "../support/mod.rs"]
mod support;
mod trajectory_growth;
mod viewpoints;
mod without_moments;
