//! Requests and answers of the service, in domain types; a file for each kind of operation.

mod bitmap;
mod block;
mod deletion;
mod event;
mod keep_out;
mod map;
mod observers;
mod occupancy;
mod point_cloud;
mod point_times;
mod scan;
mod scan_name;
mod trajectory;
mod undo;
mod version;
mod voxel_checks;
mod watch;

pub use block::{BlockAnswer, BlockForm, BlockRequest, BlockVoxels};
pub use deletion::{Deletion, DeletionAnswer, DeletionTarget, NotSeenSince};
pub use event::{EventMessage, EventsQuery, FailedScan, ScanEvent};
pub use keep_out::{DeleteKeepOut, KeepOutAnswer, KeepOutList, PutKeepOut};
pub use map::{MapElsewhere, MapFile, MapInfo, MapList, MapStorage, MapsAwake, UnavailableMap};
pub use observers::{ObservedVoxel, ObserversAnswer, ObserversRequest, ObservingScan};
pub use occupancy::{ListingRequest, PointAnswer, PointQuery, VoxelListing};
pub use point_cloud::PointCloud;
pub use point_times::{PointTimes, TimeReference};
pub use scan::{Foreground, ScanAnswer, ScanRequest};
pub use trajectory::{TrajectoryAnswer, TrajectoryQuery};
pub use undo::{Undo, UndoAnswer, UndoTarget};
pub use version::MapVersion;
pub use watch::{
    BlockBytes, Cause, ChangePart, LeftViewpoint, StatePart, WatchEvent, WatchForm, WatchMessage,
    WatchRequest, WatchedScan, WatchedSince, WatchedViewpoint,
};

pub(crate) use bitmap::bitmap;
pub(crate) use scan_name::{scan_id_too_old, scan_name};
pub(crate) use voxel_checks::{key_in_range, point_without_voxel, without_voxel};
