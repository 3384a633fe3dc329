//! The map: occupied voxel lists at many resolutions behind counting Bloom filters (paper II, III), in shards
//! behind locks.
//!
//! Reading order, with the sections of the paper:
//!
//! ```text
//! shards/                   OccupiedVoxelList    one level: its exact set behind its filter (II)
//!                           Shard                all levels of one part of space (III)
//! lookup/                   Lookup               quantize and look up, the critical path of everything (II)
//! multi_resolution_map.rs   MultiResolutionMap   the shards, and the trajectory that is stored along (III, III-B)
//! moments.rs                MomentsView          the moments of points, on which poses are refined (III-B)
//! view.rs                   MapView              reading, at one revision
//! pausing_view.rs           PausingView          reading for long, with pauses
//! listing/, regions/                             the voxels of a level, all of them or those of a part of space
//! change/, trajectory/      Change, Trajectory   what one revision did; the poses from which the map was seen (III-B)
//! commit/                   Committer            changing, one change at a time
//! contents.rs, info.rs                           all that a map holds, and what it says of itself
//! ```
//!
//! The rest stands by itself: keep-outs (`keep_out`), distances of the cells of a box (`distance_block`), which voxels
//! would be left without certain changes (`voxel_ownership`), and names, settings and hashes.

mod change;
mod commit;
mod content_hash;
mod content_history;
mod contents;
mod distance_block;
mod info;
mod keep_out;
mod listing;
pub mod lookup;
mod moments;
mod multi_resolution_map;
mod name;
mod origin;
mod pausing_view;
mod regions;
mod settings;
mod shards;
mod state_hash;
mod trajectory;
mod view;
mod voxel_ownership;

pub use change::{
    BlockFollower, Change, Committed, CompletedRequest, DeletionRecord, IdempotencyLog, KeepOutRecord,
    LevelChange, LevelSet, REQUESTS_KEPT, REQUESTS_PER_CALLER_KEPT, Request, RequestKind, TouchedBlocks,
    UndoRecord,
};
pub use commit::{Committer, ViewpointChange};
pub use content_hash::{ContentHash, ContentVersion};
pub use content_history::{ContentHistory, RevisionHashes};
pub use contents::{ContentsError, MapContents, REVISION_MAX};
pub use distance_block::{DISTANCE_CAP_MAX, DistanceBlock, margin_of};
pub use info::{FilterInfo, LevelInfo, MapDescription};
#[cfg(test)]
pub(crate) use keep_out::test_shapes;
pub use keep_out::{
    KEEP_OUTS_MAX, KeepOut, KeepOutAct, KeepOutChange, KeepOutShape, KeepOutShapeError, KeepOuts,
    KeepOutsFull, Outline, PRISM_CORNERS_MAX, Prism, PrismError, ShapeRay, TooManyVoxels,
};
pub(crate) use listing::CellBounds;
pub use listing::{BlockParts, LevelVoxels, blocks_in};
pub use lookup::Lookup;
pub use moments::MomentsView;
pub use multi_resolution_map::MultiResolutionMap;
pub use name::{
    CallerName, KeepOutName, MapName, NAME_LENGTH_MAX, NameError, RequestId, RobotName, SessionName,
};
pub use origin::{MapOrigin, MapOriginError};
pub use pausing_view::PausingView;
pub use regions::{
    CellBox, Frustum, FrustumError, OrientedBox, REGION_M_MAX, Region, RegionError, VoxelSelection,
};
pub use settings::{LEVELS_DEFAULT, MapSettings, MapSettingsError};
pub(crate) use shards::TierView;
pub use shards::{OccupiedVoxelList, SHARDS};
pub use state_hash::StateHash;
pub use trajectory::{
    ForgottenIds, ID_RANGES_PER_SESSION_MAX, KeptPoses, KnownScan, MappedScan, OverlapOfNoLevel,
    SESSIONS_PER_ROBOT_MAX, ScanRecord, Trajectory, TrajectorySpacing, ViewpointRecord, WithdrawnChange,
};
pub use view::{LongRead, MapView};
pub use voxel_ownership::{Reversal, VoxelOwnership};
