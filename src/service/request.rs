//! Requests and answers of the service, in domain types.

use std::time::Duration;

use bytes::Bytes;
use uuid::Uuid;

use super::{Reason, ServiceError};
use crate::align::{Direction, Method, Verdict};
use crate::geometry::{Point, Pose};
use crate::map::{LevelInfo, Lookup, MapName, MapSettings, MappedScan, Region, RequestId, RobotName};
use crate::mapping::Guess;
use crate::scan::PointFilter;
use crate::store::JournalUse;
use crate::util::Durations;
use crate::voxel::VoxelKey;

/// Points as they came from the wire: 12 bytes each, shared, never copied.
#[derive(Clone, PartialEq, Eq, Default)]
pub struct PointCloud(Bytes);

impl PointCloud {
    /// Points from little-endian f32 x y z.
    ///
    /// # Errors
    /// When the bytes are not a whole number of points.
    pub fn from_bytes(bytes: Bytes) -> Result<Self, ServiceError> {
        if !bytes.len().is_multiple_of(Point::BYTES) {
            let message = format!(
                "points must be a whole number of {}-byte points (x y z, little-endian f32), got {} bytes",
                Point::BYTES,
                bytes.len()
            );
            return Err(ServiceError::new(Reason::TruncatedPoints, message));
        }
        Ok(Self(bytes))
    }

    /// The points.
    pub fn as_slice(&self) -> &[Point] {
        bytemuck::cast_slice(&self.0)
    }

    /// The points' bytes, shared.
    pub fn into_bytes(self) -> Bytes {
        self.0
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.0.len() / Point::BYTES
    }

    /// True without a point.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl From<Vec<Point>> for PointCloud {
    fn from(points: Vec<Point>) -> Self {
        struct Owner(Vec<Point>);
        impl AsRef<[u8]> for Owner {
            fn as_ref(&self) -> &[u8] {
                bytemuck::cast_slice(&self.0)
            }
        }
        Self(Bytes::from_owner(Owner(points)))
    }
}

impl std::fmt::Debug for PointCloud {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} points", self.len())
    }
}

/// Which state of which map an answer speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapVersion {
    /// Committed changes so far.
    pub revision: u64,
    /// The uuid of this incarnation of the map.
    pub map_uuid: Uuid,
}

/// Are these points in occupied voxels?
#[derive(Debug, Clone)]
pub struct PointQuery {
    /// In the frame of `map_from_points`.
    pub points: PointCloud,
    /// Places the points in the map; identity where none.
    pub map_from_points: Option<Pose>,
    /// 0 is the finest.
    pub level: u32,
    /// By the exact set or by the filter alone.
    pub lookup: Lookup,
    /// Wait for this revision.
    pub min_revision: Option<u64>,
    /// The incarnation that `min_revision` belongs to.
    pub map_uuid: Option<Uuid>,
}

/// The answer to a [`PointQuery`], all at one revision.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointAnswer {
    /// Point i is bit i % 8 (lowest first) of byte i / 8.
    pub occupied: Bytes,
    /// Number of points answered.
    pub points: usize,
    /// How many of the points are occupied.
    pub points_occupied: usize,
    /// At this state.
    pub version: MapVersion,
}

/// A scan to align or insert.
#[derive(Debug, Clone)]
pub struct ScanRequest {
    /// The robot that sends the scan.
    pub robot: RobotName,
    /// The robot's own number of the scan; makes insertion idempotent.
    pub scan_id: Option<u64>,
    /// In the sensor frame; not finite = no return.
    pub points: PointCloud,
    /// When the scan was taken, nanoseconds since the Unix epoch.
    pub timestamp_ns: Option<i64>,
    /// Where it is thought to have been taken.
    pub guess: Guess,
    /// Take the guess as it is, without aligning.
    pub at_guess: bool,
    /// Add the scan where it was found even if the verdict is not `accepted`.
    pub force: bool,
    /// How to align; the server's own where none.
    pub method: Option<Method>,
    /// Say too which points fall in no occupied voxel of this level; of an alignment only.
    pub foreground_level: Option<u32>,
    /// Which points count, before what the server is set to for this robot.
    pub filter: PointFilter,
    /// Refuse the scan instead of skipping points that are not finite.
    pub strict: bool,
}

impl ScanRequest {
    /// A robot's scan, of which nothing else is said.
    pub fn new(robot: RobotName, points: PointCloud) -> Self {
        Self {
            robot,
            scan_id: None,
            points,
            timestamp_ns: None,
            guess: Guess::Last,
            at_guess: false,
            force: false,
            method: None,
            foreground_level: None,
            filter: PointFilter::default(),
            strict: false,
        }
    }
}

/// What became of a scan, or would have.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanAnswer {
    /// True when the map took it, or would.
    pub accepted: bool,
    /// What its alignment is worth.
    pub verdict: Verdict,
    /// Why, in a sentence.
    pub reason: String,
    /// Where it was taken.
    pub map_from_sensor: Pose,
    /// Fraction of its points in occupied voxels, level by level, finest first; before it was added.
    pub level_overlaps: Vec<f64>,
    /// Fraction of a sample of its points that lie on the map's surfaces.
    pub inliers: f64,
    /// How closely they do, 0 to 1.
    pub fitness: f64,
    /// Rows of the information matrix, see [`crate::align::PoseInformation`]; none of an answer that is given again.
    pub information: Option<[[f64; 6]; 6]>,
    /// Directions of the pose that the map's surfaces leave open.
    pub undetermined: Vec<Direction>,
    /// Steps of the alignment.
    pub iterations: u32,
    /// Time that it took.
    pub align_time: Duration,
    /// Points that were not finite, out of the robot's range, on its body, or out of the map's range.
    pub points_skipped: usize,
    /// Finest voxels added; 0 where nothing was.
    pub new_voxels: usize,
    /// After it, or where it was refused, before.
    pub version: MapVersion,
    /// The points that the map does not show, where they were asked for.
    pub foreground: Option<Foreground>,
    /// True of a scan that was accepted before: this is that answer.
    pub replayed: bool,
    /// The robot stands where its last scan was taken and sees nothing new: it was accepted and not kept.
    pub stationary: bool,
}

/// What is in front of the background that a map is: the points of a scan in no occupied voxel (paper \[9\]).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Foreground {
    /// Point i is bit i % 8 (lowest first) of byte i / 8; points that do not count are not of it.
    pub bitmap: Bytes,
    /// Number of its points.
    pub points: usize,
}

impl ScanAnswer {
    /// Fraction of the points in occupied voxels of level 0.
    pub fn overlap(&self) -> f64 {
        self.level_overlaps.first().copied().unwrap_or(0.0)
    }
}

/// Which voxels to take out.
#[derive(Debug, Clone)]
pub struct Deletion {
    /// Which.
    pub target: DeletionTarget,
    /// At this level: all descendants go.
    pub level: u32,
    /// The caller's own id of this deletion; makes it idempotent.
    pub request_id: Option<RequestId>,
}

/// The ways to name voxels.
#[derive(Debug, Clone)]
pub enum DeletionTarget {
    /// The voxels that these points (map frame, meters) fall in.
    Points(PointCloud),
    /// By key, of the deletion's level.
    Keys(Vec<VoxelKey>),
    /// The voxels whose centers lie inside.
    Region(Region),
}

/// What a deletion did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeletionAnswer {
    /// Finest voxels removed.
    pub removed: usize,
    /// After it.
    pub version: MapVersion,
    /// True of a deletion that was done before under its id: this is that answer.
    pub replayed: bool,
}

/// Which scans to take out again.
#[derive(Debug, Clone)]
pub struct Undo {
    /// Which.
    pub target: UndoTarget,
    /// The caller's own id of this undo; makes it idempotent.
    pub request_id: Option<RequestId>,
}

/// The ways to name accepted scans.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UndoTarget {
    /// One, by the robot's own number.
    Scan {
        /// The robot that sent the scan.
        robot: RobotName,
        /// The scan's number.
        scan_id: u64,
    },
    /// One, by the revision that it made.
    Revision(u64),
    /// All of a robot's that made a revision after this one.
    RobotSince {
        /// The robot that sent the scans.
        robot: RobotName,
        /// The last revision to keep.
        revision: u64,
    },
}

/// What an undo did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UndoAnswer {
    /// Scans taken out.
    pub scans: usize,
    /// Finest voxels that went with them.
    pub removed: usize,
    /// After it.
    pub version: MapVersion,
    /// True of an undo that was done before under its id: this is that answer.
    pub replayed: bool,
}

/// Which of the accepted scans' poses.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TrajectoryQuery {
    /// Poses of this robot alone; of all robots where none.
    pub robot: Option<RobotName>,
    /// Poses of scans that made a revision after this one.
    pub since_revision: u64,
    /// At most so many; where none, what an answer may hold.
    pub limit: Option<usize>,
}

/// The accepted scans' poses, or the next of them.
#[derive(Debug, Clone)]
pub struct TrajectoryAnswer {
    /// In the order of acceptance.
    pub poses: Vec<MappedScan>,
    /// Ask for those since this revision for the next; none where these are the last.
    pub next_since_revision: Option<u64>,
    /// At this state.
    pub version: MapVersion,
}

/// A map as a map file.
#[derive(Debug, Clone)]
pub struct MapFile {
    /// What a `.mrol` file holds.
    pub bytes: Bytes,
    /// At this state.
    pub version: MapVersion,
}

/// The occupied voxels of a level.
#[derive(Debug, Clone)]
pub struct VoxelListing {
    /// The side of the voxels, meters.
    pub resolution_m: f64,
    /// In no order.
    pub keys: Vec<VoxelKey>,
    /// At this state.
    pub version: MapVersion,
}

/// A description of a map.
#[derive(Debug, Clone)]
pub struct MapInfo {
    /// The map's name.
    pub name: MapName,
    /// The map's uuid and revision.
    pub version: MapVersion,
    /// What it was made with.
    pub settings: MapSettings,
    /// Finest first.
    pub levels: Vec<LevelInfo>,
    /// Accepted scans whose poses are kept.
    pub scans: usize,
    /// The robots that sent the scans, by name.
    pub robots: Vec<RobotName>,
    /// Bytes of memory of the exact sets of all levels.
    pub set_bytes: usize,
    /// Bytes of memory of the points' moments, which alignments are refined with.
    pub moment_bytes: usize,
    /// How long groups of changes took to become durable and visible since the server was started; not sent over the
    /// wire.
    pub commits: Durations,
    /// Bytes of memory of the trajectory, with what is known of scans whose poses are not kept.
    pub trajectory_bytes: usize,
    /// How it is kept; not at all without a data folder.
    pub storage: Option<MapStorage>,
}

/// How a map is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapStorage {
    /// The last revision that is known to be synced.
    pub durable_revision: u64,
    /// The revision of the newest snapshot.
    pub snapshot_revision: u64,
    /// Scans of this revision and later can be undone.
    pub undo_from_revision: u64,
    /// What the journal has done since the server was started; not sent over the wire, as all below but `failure`.
    pub journal: JournalUse,
    /// Time since the newest snapshot was written, or since the server was started where that was later.
    pub snapshot_age: Duration,
    /// Snapshots that could not be written since the server was started.
    pub snapshot_failures: u64,
    /// Bytes on disk.
    pub disk_bytes: u64,
    /// Why the map takes no changes, where it does not.
    pub failure: Option<String>,
}

/// The maps that a caller may name, by name.
#[derive(Debug, Clone, Default)]
pub struct MapList {
    /// The maps that are served.
    pub maps: Vec<MapInfo>,
    /// The maps that could not be opened.
    pub unavailable: Vec<UnavailableMap>,
}

/// A map that could not be opened. Nothing can be done with it but to put its files right, and to start again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnavailableMap {
    /// The map's name, which is taken.
    pub name: MapName,
    /// Why, and the command that helps.
    pub reason: String,
}
