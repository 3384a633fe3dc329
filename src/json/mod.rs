//! JSON, written once for the HTTP interface, `--json` and the settings file.

pub mod described;
mod event;
mod keep_out;
mod keyword;
mod localization;
mod map;
mod observers;
mod pose;
mod scan;
mod vectors;
mod version;

pub use event::{JsonEvent, JsonFailure};
pub use keep_out::{JsonKeepOut, JsonShape};
pub(crate) use keyword::described_by_words;
pub use keyword::{ByKeyword, schema_of_words};
pub use localization::{JsonCandidate, JsonLocalization};
pub use map::{
    JsonFilter, JsonFilterInfo, JsonLevel, JsonMap, JsonSettings, JsonSighting, JsonStorage, NO_FILTER,
};
pub use observers::{JsonObservers, JsonObservingScan};
pub use pose::JsonPose;
pub use scan::{JsonDirection, JsonScan};
pub use vectors::{
    Corners3, PoseMatrix, PoseNumbers, PoseVector, Quaternion, Sizes2, Sphere, Vector2, Vector3, VoxelIndex,
};
pub use version::JsonVersion;
