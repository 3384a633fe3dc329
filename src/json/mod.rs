//! JSON, written once for the HTTP interface, `--json` and the settings file.

mod agreement;
pub mod described;
mod event;
mod keep_out;
mod keyword;
mod localization;
mod map;
mod observers;
mod pose;
mod scan;
mod text;
mod vectors;
mod version;

pub use self::agreement::{JsonRayAgreement, JsonRayCounts, JsonRival};
pub use self::event::{JsonEvent, JsonFailure};
pub use self::keep_out::{JsonKeepOut, JsonShape};
pub(crate) use self::keyword::described_by_words;
pub use self::keyword::{ByKeyword, schema_of_words};
pub use self::localization::{JsonCandidate, JsonLocalization};
pub use self::map::{
    JsonFilter, JsonFilterInfo, JsonLevel, JsonMap, JsonSettings, JsonSighting, JsonStorage, NO_FILTER,
};
pub use self::observers::{JsonObservers, JsonObservingScan};
pub use self::pose::JsonPose;
pub use self::scan::{JsonDirection, JsonScan};
pub use self::text::ByText;
pub use self::vectors::{
    Corners3, PoseMatrix, PoseNumbers, PoseVector, Quaternion, Sizes2, Sphere, Vector2, Vector3, VoxelIndex,
};
pub use self::version::JsonVersion;
