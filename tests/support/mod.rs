//! What tests share: servers to ask, disks that fail, models to compare with, and scans.

#![allow(clippy::allow_attributes, dead_code, reason = "each test binary uses its own part of it")]
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
#![allow(unreachable_pub, reason = "a test has no crate to reach it from")]

pub mod box_in_room;
pub mod daemon;
pub mod description;
pub mod disk;
pub mod hall;
pub mod hostile_files;
pub mod map_folders;
#[cfg(target_os = "linux")]
pub mod memory;
pub mod plain_set;
pub mod process;
pub mod program;
pub mod range_images;
pub mod sequence;
pub mod shared_scans;
pub mod simulated_disk;
pub mod skipped;
pub mod watchdog;
