//! Watching a map: what is asked for, and the messages that tell of its changes.

use bytes::Bytes;
use uuid::Uuid;

use crate::error::{Reason, ServiceError};
use mrol_map::geometry::Pose;
use mrol_map::map::{
    ContentHash, ContentVersion, KeepOut, KeepOutChange, MappedScan, Region, RobotName, SessionName,
    StateHash,
};
use mrol_map::voxel::{BlockMask, VoxelKey, VoxelSet};

/// What to watch of a map.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WatchRequest {
    /// What the caller has already; without, the whole state comes first.
    pub since: Option<WatchedSince>,
    /// The part that is watched: voxels whose centers lie inside. Without, the whole map.
    pub region: Option<Region>,
    /// In which form changes are told.
    pub form: WatchForm,
    /// True to be told of viewpoints: where scans saw through. Of a region those that may have looked into it, and some
    /// more.
    pub viewpoints: bool,
}

/// What a caller has of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WatchedSince {
    /// The last revision that it was told of.
    pub revision: u64,
    /// The map that this is a revision of.
    pub map_uuid: Uuid,
    /// The content hash that the map had at that revision, as the caller was told. Where the map had another, or none
    /// that is known, the whole state comes first: an older data folder was put back, and the caller has what was lost.
    /// Without it, the revision alone is believed.
    pub content_hash: Option<ContentHash>,
    /// The state hash that the map had at that revision, as the caller was told: the same for keep-outs and viewpoints
    /// too.
    pub state_hash: Option<StateHash>,
}

/// In which form changes are told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WatchForm {
    /// The finest voxels that each change touched, as they were recorded: for replicas.
    #[default]
    Changes,
    /// The voxels of a level that appeared and went: for viewers.
    Deltas {
        /// The level.
        level: u32,
    },
}

/// A message of a watch.
#[derive(Debug, Clone, PartialEq)]
pub struct WatchMessage {
    /// The map that it tells of.
    pub map_uuid: Uuid,
    /// The newest revision that is durable: what a watch tells of reaches up to it.
    pub head_revision: u64,
    /// Hash of all that a copy may hold at the revision that it tells of, of a heartbeat the head; none where it is not
    /// known.
    pub state_hash: Option<StateHash>,
    /// What it tells.
    pub event: WatchEvent,
}

/// What a message of a watch tells.
#[derive(Debug, Clone, PartialEq)]
pub enum WatchEvent {
    /// Nothing has changed: all revisions up to the head's were told.
    Heartbeat,
    /// A part of what the map holds at one revision. The first part says to forget everything else.
    State(StatePart),
    /// A part of one change. Revisions come one after the other, without a gap.
    Change(ChangePart),
}

/// A part of the state of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct StatePart {
    /// True of the first part: what was told before holds no more.
    pub is_first: bool,
    /// True of the last part.
    pub is_last: bool,
    /// The revision that all parts are of, with the hash of what the whole map holds then.
    pub version: ContentVersion,
    /// Side of the finest voxels, meters.
    pub resolution_m: f64,
    /// Levels of the map.
    pub levels: u32,
    /// The level of the voxels.
    pub level: u32,
    /// Occupied voxels.
    pub voxels: BlockBytes,
    /// All keep-outs of the map, by name, wherever they lie: in the first part.
    pub keep_outs: Vec<KeepOut>,
    /// Viewpoints where they were asked for, ascending by revision, in the last parts.
    pub viewpoints: Vec<WatchedViewpoint>,
}

/// A viewpoint, as a watch tells of it.
#[derive(Debug, Clone, PartialEq)]
pub struct WatchedViewpoint {
    /// The revision that its scan made.
    pub revision: u64,
    /// Where the scan was taken.
    pub map_from_sensor: Pose,
    /// The bytes of its range image.
    pub image: Bytes,
}

/// The viewpoint that a scan left at its pose, as a watch tells of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftViewpoint {
    /// The bytes of its range image; empty where it did not look into the region that is watched.
    pub image: Bytes,
    /// The revisions of the scans whose viewpoints went, ascending.
    pub displaced: Vec<u64>,
}

/// A part of a change: the voxels of `removed` go, then those of `added` come. No voxel is in both.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangePart {
    /// The revision that the change made.
    pub revision: u64,
    /// True of the last part of the change.
    pub is_last: bool,
    /// Hash of what the whole map holds after the change, where it is known: a change from before the
    /// snapshot that the map was opened from has none.
    pub content_hash: Option<ContentHash>,
    /// What made the change.
    pub cause: Cause,
    /// Of changes: the finest voxels that a scan saw through, a deletion took out, or that went with an undo. Of
    /// deltas: the voxels of the level that went.
    pub removed: BlockBytes,
    /// Of changes: the finest voxels that a scan touched, new or not, or that an undo put back. Of deltas: the voxels
    /// of the level that appeared.
    pub added: BlockBytes,
    /// The viewpoint that a scan left, where it was asked for: in the last part.
    pub viewpoint: Option<LeftViewpoint>,
}

/// What made a change.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// A scan that was inserted.
    Scan(Box<WatchedScan>),
    /// A deletion.
    Deletion,
    /// An undo.
    Undo {
        /// The revisions of the scans that were taken back, ascending.
        scans: Vec<u64>,
        /// The revisions of the deletions that were taken back, ascending.
        deletions: Vec<u64>,
    },
    /// A keep-out that was put or ended. No voxel changes.
    KeepOut(KeepOutChange),
}

/// A scan, as a watch tells of it.
#[derive(Debug, Clone, PartialEq)]
pub struct WatchedScan {
    /// The robot that sent it.
    pub robot: RobotName,
    /// The run of the robot's software.
    pub session: SessionName,
    /// The robot's own number of it.
    pub scan_id: Option<u64>,
    /// When it was taken, nanoseconds since the Unix epoch.
    pub timestamp_ns: Option<i64>,
    /// Where it was taken.
    pub map_from_sensor: Pose,
    /// Finest voxels that it carved.
    pub carved_voxels: usize,
}

impl From<MappedScan> for WatchedScan {
    fn from(scan: MappedScan) -> Self {
        let MappedScan { robot, session, scan_id, timestamp_ns, map_from_sensor, carved_voxels, .. } = scan;
        Self { robot, session, scan_id, timestamp_ns, map_from_sensor, carved_voxels }
    }
}

/// Voxels as blocks of 8 x 8 x 8 of them, 72 bytes each: the packed key of the block (21 bits an axis, in units of
/// blocks of the level), then its voxels as eight words of 64 bits, a bit a voxel in Morton order (bits z2 y2 x2 z1 y1
/// x1 z0 y0 x0 of the position in the block). All numbers are little-endian.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BlockBytes(Bytes);

impl BlockBytes {
    /// Bytes of a block.
    pub const OF_BLOCK: usize = size_of::<u64>() + BlockMask::BYTES;

    /// The bytes of `blocks`.
    pub fn of(blocks: &[(VoxelKey, BlockMask)]) -> Self {
        let mut bytes = Vec::with_capacity(blocks.len() * Self::OF_BLOCK);
        for (block, mask) in blocks {
            bytes.extend_from_slice(&block.to_bits().to_le_bytes());
            bytes.extend_from_slice(&mask.to_le_bytes());
        }
        Self(bytes.into())
    }

    /// The voxels, where `bytes` are those of blocks.
    ///
    /// # Errors
    /// `InvalidArgument` for bytes that are no whole number of blocks.
    pub fn new(bytes: Bytes) -> Result<Self, ServiceError> {
        if bytes.len().is_multiple_of(Self::OF_BLOCK) {
            return Ok(Self(bytes));
        }
        let message = format!("blocks must have {} bytes each, got {} in all", Self::OF_BLOCK, bytes.len());
        Err(ServiceError::new(Reason::BadBlocks, message))
    }

    /// The voxels as a set.
    ///
    /// # Errors
    /// `InvalidArgument` for the key of no block.
    pub fn to_set(&self) -> Result<VoxelSet, ServiceError> {
        self.blocks().collect()
    }

    /// The blocks, one by one.
    ///
    /// # Errors
    /// `InvalidArgument` for the key of no block.
    pub fn blocks(&self) -> impl Iterator<Item = Result<(VoxelKey, BlockMask), ServiceError>> + '_ {
        let (blocks, _) = self.0.as_chunks::<{ Self::OF_BLOCK }>();
        blocks.iter().map(|bytes| {
            let key = u64::from_le_bytes(std::array::from_fn(|i| bytes[i]));
            let mask = BlockMask::from_le_bytes(&std::array::from_fn(|i| bytes[size_of::<u64>() + i]));
            let no_key =
                || ServiceError::new(Reason::BadBlocks, format!("block key {key:#x} is out of range"));
            Ok((VoxelSet::block_key(key).ok_or_else(no_key)?, mask))
        })
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.0.len() / Self::OF_BLOCK
    }

    /// True without a block.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Takes the first blocks out, at most so many. They share the memory.
    pub fn split_to(&mut self, blocks: usize) -> Self {
        Self(self.0.split_to(self.0.len().min(blocks * Self::OF_BLOCK)))
    }

    /// The bytes.
    pub fn into_bytes(self) -> Bytes {
        self.0
    }
}
