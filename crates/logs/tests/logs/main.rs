//! Logs as drivers and recorders write them become scans, and scans a map.
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

#[cfg(feature = "sqlite")]
mod bags;
mod cameras;
mod drivers;
mod hostile;
mod mapping;
mod mcap;
mod sequence;
mod shared_rules;
mod support;
