//! The operations of the server, once for every protocol: domain types in, domain types out.
//!
//! Limits are checked here and before any work is done; every failure is a [`ServiceError`].
//!
//! Reading order of the rooms; none names a room of a later line:
//!
//! 1. `error`, `setting`, `limits`, `request`: how a request fails, what a setting is, how much a request may ask, what
//!    it asks and how it is answered.
//! 2. `replication`, `cluster`: a log that several nodes share, and what one of them asks of the others.
//! 3. `resources`, `caller`, `observer`, `settings`, `work`: disk and memory, callers, observers, settings, threads.
//! 4. `commit`: how changes of a map become durable, then visible, then acknowledged.
//! 5. `maps`: the maps by name, and what a hosted map is made of.
//! 6. `map_service`: [`MapService`], the handle of which every operation is a method.
//! 7. `at_the_leader`: an operation of which one node makes the changes, here or there.
//! 8. `lifecycle`, `read`, `question`, `watch`, `scan`, `change`: the operations, by kind.

mod at_the_leader;
mod caller;
mod change;
mod cluster;
mod commit;
mod error;
mod lifecycle;
mod limits;
mod map_service;
mod maps;
mod observer;
mod question;
mod read;
pub mod replication;
mod request;
mod resources;
mod scan;
mod setting;
mod settings;
#[cfg(feature = "testing")]
mod testing;
#[cfg(test)]
mod tests;
mod watch;
mod work;

pub use caller::{AllowedMaps, AllowedScans};
pub use cluster::{Cluster, Forward, ForwardedCall, ForwardedEvents, Later, NewMap, NoRoom, SharedCatalog};
pub use commit::Lead;
pub use error::{ErrorCode, MapHolder, Reason, ReportedBy, ServiceError};
pub use lifecycle::SharedMap;
pub use limits::{Limits, Marks};
pub use map_service::MapService;
pub use observer::{Change, End, Ended, JudgedScan, Observer, Outcome};
pub use question::{
    AtVersion, CheckAs, ClassifyQuestion, Collisions, FRONTIERS_MAX_DEFAULT, FrontierQuestion, GridQuestion,
    GridScope, GridTile, GridTiles, KnownPart, MotionCheck, NearestQuestion, PoseCheck, Question,
    QuestionScope, QuestionTarget, RayQuestion, RaysToward, SphereCheck, TILED_CELLS_MAX,
};
pub use request::{
    BlockAnswer, BlockBytes, BlockForm, BlockRequest, BlockVoxels, Cause, ChangePart, DeleteKeepOut,
    Deletion, DeletionAnswer, DeletionTarget, EventMessage, EventsQuery, FailedScan, Foreground,
    KeepOutAnswer, KeepOutList, LeftViewpoint, ListingRequest, MapElsewhere, MapFile, MapInfo, MapList,
    MapStorage, MapVersion, MapsAwake, NotSeenSince, ObservedVoxel, ObserversAnswer, ObserversRequest,
    ObservingScan, PointAnswer, PointCloud, PointQuery, PointTimes, PutKeepOut, ScanAnswer, ScanEvent,
    ScanRequest, StatePart, TimeReference, TrajectoryAnswer, TrajectoryQuery, UnavailableMap, Undo,
    UndoAnswer, UndoTarget, VoxelListing, WatchEvent, WatchForm, WatchMessage, WatchRequest, WatchedScan,
    WatchedSince, WatchedViewpoint,
};
pub use resources::{Gauges, MemoryReading, Readings, Shortage};
pub use scan::{
    CANDIDATES_DEFAULT, CandidateAnswer, EventWatch, LocalizationAnswer, LocalizationRequest, SEARCH_SHARE,
    TIME_LIMIT_DEFAULT, TrajectoryPieces,
};
pub use setting::{OutOfRange, Setting, SettingKind, SettingValue, Unit};
pub use settings::{Adoption, EVERY_ROBOT, RobotSettings, ServiceSettings};
pub use watch::Watch;
pub use work::{Asker, LaneUse};
