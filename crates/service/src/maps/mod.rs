//! The maps by name, and what the service keeps about each.
//!
//! A [`Catalog`] has a [`HostedMap`] for each name. What a hosted map is made of stands beside it: `followers`,
//! `robots`, `snapshots`, `keep_out_expiry`. A map that nobody uses leaves memory (`sleeping`, `asleep`). What is done
//! with a hosted map is in the rooms above, as further `impl HostedMap` blocks.

mod asleep;
mod built_map;
mod catalog;
mod event_log;
mod followers;
mod full_state;
mod hosted_map;
mod keep_out_expiry;
mod named;
mod newcomers;
mod node_mark;
mod opening;
mod renaming;
mod replacing;
mod robots;
mod same_settings;
mod saving;
mod sleeping;
mod snapshots;
mod start;

pub(crate) use built_map::BuiltMap;
pub(crate) use catalog::Catalog;
pub(crate) use full_state::FullState;
pub(crate) use hosted_map::{HostedMap, RATE_SAMPLES};
pub(crate) use opening::maps_at_once;
pub(crate) use same_settings::same_settings;
pub(crate) use saving::Saving;
pub(crate) use snapshots::snapshot_bytes;
