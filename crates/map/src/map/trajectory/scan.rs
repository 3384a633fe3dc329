//! A scan as it enters a map, and what is kept of it.

use crate::geometry::{Point, Pose};
use crate::map::name::{RobotName, SessionName};
use crate::visibility::RangeImage;
use crate::voxel::{Lattice, MomentSet, VoxelSet};

/// A scan as it enters a map: everything that replaying the insertion needs, nothing that would have to be
/// computed again in floating point.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanRecord {
    /// What is kept of it in the trajectory; its revision, new and carved voxels are filled in by the commit.
    pub pose: MappedScan,
    /// Every distinct finest voxel that the scan touches, known before or not.
    pub voxels: VoxelSet,
    /// Finest voxels that were there and go, since the scan saw through them: none of `voxels`. They go before its own
    /// come.
    pub carved: VoxelSet,
    /// What its points add to the moments of their voxels; nothing in a map that keeps none.
    pub moments: MomentSet,
    /// What it saw through, where it saw something new.
    pub viewpoint: Option<ViewpointRecord>,
}

/// The viewpoint that a scan leaves: its pose is the scan's.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewpointRecord {
    /// How far it saw in each direction.
    pub image: RangeImage,
    /// The revisions of the scans whose viewpoints go, since there is no more room for them; ascending. They stay gone
    /// when the scan is undone: what they saw is unknown then, never free.
    pub displaced: Vec<u64>,
}

impl ScanRecord {
    /// What a scan of `points` (sensor frame) taken at `pose` does to a map on `lattice`. Points without a voxel are
    /// left out and counted in `pose.points_skipped`.
    pub fn of_points(mut pose: MappedScan, points: &[Point], lattice: &Lattice) -> Self {
        let quantize = lattice.from_points(&pose.map_from_sensor);
        let (voxels, out_of_range) = VoxelSet::of_points(points, &quantize);
        pose.points_skipped += out_of_range;
        Self { moments: MomentSet::of_points(points, &quantize), ..Self::of_voxels(pose, voxels) }
    }

    /// [`ScanRecord::of_points`] for a map that keeps no moments.
    pub fn without_moments(mut pose: MappedScan, points: &[Point], lattice: &Lattice) -> Self {
        let (voxels, out_of_range) = VoxelSet::of_points(points, &lattice.from_points(&pose.map_from_sensor));
        pose.points_skipped += out_of_range;
        Self::of_voxels(pose, voxels)
    }

    /// A record of voxels whose points are not known: the refinement of alignments learns nothing from it.
    pub fn of_voxels(pose: MappedScan, voxels: VoxelSet) -> Self {
        Self { pose, voxels, carved: VoxelSet::default(), moments: MomentSet::default(), viewpoint: None }
    }
}

/// One accepted scan.
#[derive(Debug, Clone, PartialEq)]
pub struct MappedScan {
    /// The robot that sent the scan.
    pub robot: RobotName,
    /// The run of the robot's software that sent it.
    pub session: SessionName,
    /// The robot's own number of the scan, unique in its session.
    pub scan_id: Option<u64>,
    /// When the scan was taken, nanoseconds since the Unix epoch.
    pub timestamp_ns: Option<i64>,
    /// Where it was taken.
    pub map_from_sensor: Pose,
    /// The revision that it made.
    pub revision: u64,
    /// Fraction of its points in occupied voxels before it was added, level by level, finest first.
    pub level_overlaps: Vec<f64>,
    /// Steps of its alignment.
    pub iterations: u32,
    /// Points that were not finite or out of range.
    pub points_skipped: usize,
    /// Finest voxels that it added.
    pub new_voxels: usize,
    /// Finest voxels that it carved.
    pub carved_voxels: usize,
    /// A digest of the request, so that the same scan sent again is told from another under its id.
    pub digest: u64,
}

impl MappedScan {
    /// A robot's scan at `map_from_sensor`, of which nothing else is known.
    pub fn new(robot: RobotName, map_from_sensor: Pose) -> Self {
        Self {
            robot,
            session: SessionName::default(),
            scan_id: None,
            timestamp_ns: None,
            map_from_sensor,
            revision: 0,
            level_overlaps: Vec::new(),
            iterations: 0,
            points_skipped: 0,
            new_voxels: 0,
            carved_voxels: 0,
            digest: 0,
        }
    }

    /// Fraction of the points in occupied voxels of level 0, before the scan was added.
    pub fn overlap(&self) -> f64 {
        self.level_overlaps.first().copied().unwrap_or(0.0)
    }

    /// Whether a map of so many levels can have recorded it.
    ///
    /// # Errors
    /// When it has an overlap of a level that the map lacks.
    pub fn check_levels(&self, levels: u32) -> Result<(), OverlapOfNoLevel> {
        let overlaps = self.level_overlaps.len();
        (overlaps <= levels as usize).then_some(()).ok_or(OverlapOfNoLevel { overlaps, levels })
    }
}

/// A scan with more overlaps than its map has levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a scan with {overlaps} overlaps, of a map of {levels} levels")]
pub struct OverlapOfNoLevel {
    /// Overlaps of the scan.
    pub overlaps: usize,
    /// Levels of the map.
    pub levels: u32,
}

/// A scan or a deletion that was taken back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WithdrawnChange {
    /// The revision that it had made.
    pub change: u64,
    /// The revision that took it back.
    pub revision: u64,
}
