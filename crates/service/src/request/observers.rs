//! The scans that touched a voxel.

use super::version::MapVersion;
use super::watch::WatchedScan;
use mrol_map::geometry::Point;
use mrol_map::voxel::VoxelKey;

/// Which scans touched this voxel?
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserversRequest {
    /// The voxel.
    pub voxel: ObservedVoxel,
    /// Its level; 0 is the finest. A voxel of another one was touched where a descendant was.
    pub level: u32,
}

/// A voxel that somebody asks about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ObservedVoxel {
    /// The one that a point falls in (map frame).
    Of(Point),
    /// The one with a key.
    Key(VoxelKey),
}

/// The scans that touched a voxel.
#[derive(Debug, Clone, PartialEq)]
pub struct ObserversAnswer {
    /// The voxel.
    pub voxel: VoxelKey,
    /// The newest scans that touched it and were not undone, newest first.
    pub scans: Vec<ObservingScan>,
    /// True where there are older ones, or may be: more than are listed, of before what the journal reaches back to, or
    /// where it took too long to look.
    pub older_scans: bool,
    /// At this state.
    pub version: MapVersion,
}

/// A scan that touched a voxel.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservingScan {
    /// The revision that it made.
    pub revision: u64,
    /// The scan.
    pub scan: WatchedScan,
}
