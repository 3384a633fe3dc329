//! JSON, written once for the HTTP interface, `--json` and the settings file.

mod keyword;
mod localization;
mod map;
mod pose;
mod scan;
mod version;

pub use keyword::ByKeyword;
pub use localization::{JsonCandidate, JsonLocalization};
pub use map::{
    JsonFilter, JsonFilterInfo, JsonLevel, JsonMap, JsonSettings, JsonSighting, JsonStorage, NO_FILTER,
};
pub use pose::JsonPose;
pub use scan::{JsonDirection, JsonScan};
pub use version::JsonVersion;
