//! JSON, written once for the HTTP interface, `--json` and the settings file.

mod event;
mod keep_out;
mod keyword;
mod localization;
mod map;
mod observers;
mod pose;
mod scan;
mod version;

pub use event::{JsonEvent, JsonFailure};
pub use keep_out::{JsonKeepOut, JsonShape};
pub use keyword::ByKeyword;
pub use localization::{JsonCandidate, JsonLocalization};
pub use map::{
    JsonFilter, JsonFilterInfo, JsonLevel, JsonMap, JsonSettings, JsonSighting, JsonStorage, NO_FILTER,
};
pub use observers::{JsonObservers, JsonObservingScan};
pub use pose::JsonPose;
pub use scan::{JsonDirection, JsonScan};
pub use version::JsonVersion;
