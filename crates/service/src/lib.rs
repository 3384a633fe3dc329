//! The operations of the server, once for every protocol: domain types in, domain types out.
//!
//! Limits are checked here and before any work is done; every failure is a [`ServiceError`].

mod allowed_maps;
mod allowed_scans;
mod asker;
mod block;
mod built_map;
mod catalog;
mod commit_queue;
mod completed_request;
mod deletion;
mod digest;
mod error;
mod error_code;
mod event_log;
mod events;
mod expiry_state;
mod filtered_scan;
mod followers;
mod full_state;
mod gauges;
mod growth;
mod hosted_map;
mod keep_out;
mod keep_out_expiry;
mod limits;
mod listing;
mod localization;
#[cfg(test)]
mod looks;
mod map_file;
mod map_service;
mod mapper;
mod mapping;
mod maps;
#[cfg(all(test, feature = "shuttle"))]
mod modeled;
mod named;
mod observer;
mod observers;
mod outbox;
mod point_query;
mod pool;
mod pools;
mod question;
mod reason;
mod recent_changes;
mod recovery;
mod request;
mod resource_budget;
mod robots;
mod saving;
mod scans;
mod settings;
mod shortage;
mod snapshots;
mod stop;
mod submission;
#[cfg(feature = "testing")]
mod testing;
mod thread_queue;
mod time_limit;
mod trajectory;
mod undo;
mod unseen;
mod watch;
mod watermarks;

pub use allowed_maps::AllowedMaps;
pub use allowed_scans::AllowedScans;
pub use asker::Asker;
pub use error::ServiceError;
pub use error_code::ErrorCode;
pub use event_log::EVENTS_MAX;
pub use events::EventWatch;
pub use gauges::{Gauges, MemoryReading, Readings};
pub use limits::{Limits, Marks};
pub use localization::{
    CANDIDATES_DEFAULT, CandidateAnswer, LocalizationAnswer, LocalizationRequest, SEARCH_SHARE,
    TIME_LIMIT_DEFAULT,
};
pub use map_service::MapService;
pub use observer::{Change, End, Ended, JudgedScan, Observer, Outcome};
pub use pool::PoolUse;
pub use question::{
    Answered, Asked, CheckAs, ClassifyQuestion, Collisions, FRONTIERS_MAX_DEFAULT, FrontierQuestion,
    GridQuestion, GridScope, KnownPart, MotionCheck, NearestQuestion, PoseCheck, Question, QuestionedMap,
    RayQuestion, RaysToward, SphereCheck,
};
pub use reason::{Reason, ToldBy};
pub use request::{
    BlockAnswer, BlockBytes, BlockForm, BlockRequest, BlockVoxels, Cause, ChangePart, DeleteKeepOut,
    Deletion, DeletionAnswer, DeletionTarget, EventMessage, EventsQuery, FailedScan, Foreground,
    KeepOutAnswer, KeepOutList, LeftViewpoint, ListingRequest, MapFile, MapInfo, MapList, MapStorage,
    MapVersion, NotSeenSince, ObservedVoxel, ObserversAnswer, ObserversRequest, ObservingScan, PointAnswer,
    PointCloud, PointQuery, PointTimes, PutKeepOut, ScanAnswer, ScanEvent, ScanRequest, StatePart,
    TimeReference, TrajectoryAnswer, TrajectoryQuery, UnavailableMap, Undo, UndoAnswer, UndoTarget,
    VoxelListing, WatchEvent, WatchForm, WatchMessage, WatchRequest, WatchedScan, WatchedSince,
    WatchedViewpoint,
};
pub use settings::{EVERY_ROBOT, RobotSettings, ServiceSettings};
pub use shortage::Shortage;
pub use trajectory::TrajectoryPieces;
pub use watch::Watch;

pub(crate) use map_service::{Inner, commit_thread_ended};
pub(crate) use time_limit::{check_not_stopped, ended_early};
