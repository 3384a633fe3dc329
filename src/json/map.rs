//! The description of a map in JSON.

use std::borrow::Cow;

use serde::{Serialize, Serializer};
use utoipa::openapi::schema::OneOfBuilder;
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use super::described;
use super::keyword::schema_of_words;
use super::pose::JsonPose;
use super::version::JsonVersion;
use mrol_client::wire::nanoseconds;
use mrol_map::bloom::FilterSettings;
use mrol_map::map::{FilterInfo, LevelInfo, MapSettings};
use mrol_map::mapping::Sighting;
use mrol_service::{MapInfo, MapStorage};

/// A map's description.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Map)]
pub struct JsonMap {
    /// The name.
    pub map: String,
    /// The uuid and the revision.
    #[serde(flatten)]
    pub version: JsonVersion,
    /// The settings.
    pub settings: JsonSettings,
    /// The levels, finest first.
    pub levels: Vec<JsonLevel>,
    /// Scans that were accepted and not undone.
    pub scans: usize,
    /// Those of them whose poses are kept: old poses are thinned.
    pub poses: usize,
    /// The robots that sent them, by name.
    pub robots: Vec<String>,
    /// The last scan of each robot since the server was started; of one map alone.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sightings: Vec<JsonSighting>,
    /// True of a map that is not in memory: what is told of it is from when it left, and the next request opens it.
    pub asleep: bool,
    /// Bytes of the exact sets.
    pub set_bytes: usize,
    /// Bytes of the moments of points.
    pub moment_bytes: usize,
    /// Bytes of the trajectory.
    pub trajectory_bytes: usize,
    /// Number of viewpoints.
    pub viewpoints: usize,
    /// Bytes of the viewpoints.
    pub viewpoint_bytes: usize,
    /// What lies on disk; null where nothing does.
    pub storage: Option<JsonStorage>,
}

/// A robot as its last scan showed it.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Sighting)]
pub struct JsonSighting {
    /// The robot.
    pub robot: String,
    /// When the server judged the scan, nanoseconds since the Unix epoch.
    pub seen_at_ns: i64,
    /// When the scan was taken, nanoseconds since the Unix epoch; null where it does not tell.
    pub timestamp_ns: Option<i64>,
    /// Where it was found; of one that was refused, where its alignment ended.
    pub map_from_sensor: JsonPose,
    /// Whether it fits there.
    #[schema(value_type = described::Verdict)]
    pub verdict: &'static str,
    /// The robot stood where its last stored scan was taken, and saw nothing new.
    pub stationary: bool,
}

impl From<&Sighting> for JsonSighting {
    fn from(sighting: &Sighting) -> Self {
        Self {
            robot: sighting.robot.to_string(),
            seen_at_ns: nanoseconds(sighting.seen_at),
            timestamp_ns: sighting.timestamp_ns,
            map_from_sensor: (&sighting.map_from_sensor).into(),
            verdict: sighting.verdict.as_str(),
            stationary: sighting.is_stationary,
        }
    }
}

/// What of a map lies on disk.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Storage)]
pub struct JsonStorage {
    /// Changes up to this revision survive the loss of power.
    pub durable_revision: u64,
    /// The revision of the newest snapshot.
    pub snapshot_revision: u64,
    /// Scans from this revision on can be undone.
    pub undo_from_revision: u64,
    /// Why no changes are taken; null where they are.
    pub read_only: Option<String>,
}

/// The settings of a map.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Settings)]
pub struct JsonSettings {
    /// Side of a voxel, meters.
    pub resolution_m: f64,
    /// The number of levels.
    pub levels: u32,
    /// The filters; `"none"` where there are none.
    #[schema(value_type = JsonFilterOrNone)]
    #[serde(serialize_with = "filter_or_word")]
    pub filter: Option<JsonFilter>,
    /// False of a map that keeps no moments of its points.
    pub moments: bool,
    /// Where the map's origin lies in the frame of a survey, meters: a place p of the map is at p + origin_m there.
    #[schema(required = false)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin_m: Option<[f64; 3]>,
}

/// What stands for the settings of filters where a map has none.
pub const NO_FILTER: &str = "none";

fn filter_or_word<S: Serializer>(filter: &Option<JsonFilter>, to: S) -> Result<S::Ok, S::Error> {
    match filter {
        Some(filter) => filter.serialize(to),
        None => to.serialize_str(NO_FILTER),
    }
}

/// The settings of filters, or the word for none: how the description of the API knows [`filter_or_word`].
struct JsonFilterOrNone;

impl ToSchema for JsonFilterOrNone {
    fn name() -> Cow<'static, str> {
        "FilterOrNone".into()
    }
}

impl PartialSchema for JsonFilterOrNone {
    fn schema() -> RefOr<Schema> {
        OneOfBuilder::new().item(JsonFilter::schema()).item(schema_of_words([NO_FILTER])).into()
    }
}

/// The settings of filters.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Filter)]
pub struct JsonFilter {
    /// Hash functions.
    pub hashes: u32,
    /// Bits of a plane a voxel, just before growth.
    pub bits_per_key: f64,
}

/// One level of a map.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Level)]
pub struct JsonLevel {
    /// The level, 0 the finest.
    pub level: u32,
    /// Side of a voxel, meters.
    pub resolution_m: f64,
    /// Occupied voxels.
    pub voxels: usize,
    /// The filters; without their fields where the map has none.
    #[serde(flatten)]
    pub filter: Option<JsonFilterInfo>,
}

/// The filters of one level of a map.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = FilterInfo)]
pub struct JsonFilterInfo {
    /// Bytes of the bit planes.
    pub plane_bytes: usize,
    /// Bytes of the counters.
    pub counter_bytes: usize,
    /// The false-positive rate by the closed form of blocked filters.
    pub expected_false_positive_rate: f64,
    /// The false-positive rate by eq. (1) of the paper.
    pub ideal_false_positive_rate: f64,
    /// The false-positive rate measured on absent neighbors of occupied voxels; null where there are none.
    pub measured_false_positive_rate: Option<f64>,
}

impl From<MapInfo> for JsonMap {
    fn from(info: MapInfo) -> Self {
        Self {
            map: info.name.to_string(),
            version: info.version.into(),
            settings: info.settings.into(),
            levels: info.levels.iter().map(Into::into).collect(),
            scans: info.scans,
            poses: info.poses,
            robots: info.robots.iter().map(ToString::to_string).collect(),
            sightings: info.sightings.iter().map(Into::into).collect(),
            asleep: info.is_asleep,
            set_bytes: info.set_bytes,
            moment_bytes: info.moment_bytes,
            trajectory_bytes: info.trajectory_bytes,
            viewpoints: info.viewpoints,
            viewpoint_bytes: info.viewpoint_bytes,
            storage: info.storage.map(Into::into),
        }
    }
}

impl From<MapStorage> for JsonStorage {
    fn from(storage: MapStorage) -> Self {
        Self {
            durable_revision: storage.durable_revision,
            snapshot_revision: storage.snapshot_revision,
            undo_from_revision: storage.undo_from_revision,
            read_only: storage.failure,
        }
    }
}

impl From<MapSettings> for JsonSettings {
    fn from(MapSettings { resolution_m, levels, filter, moments, origin }: MapSettings) -> Self {
        let json = |FilterSettings { hashes, bits_per_key }| JsonFilter { hashes, bits_per_key };
        let origin_m = origin.map(|origin| origin.position_m);
        Self { resolution_m, levels, filter: filter.map(json), moments, origin_m }
    }
}

impl From<&LevelInfo> for JsonLevel {
    fn from(info: &LevelInfo) -> Self {
        Self {
            level: info.level,
            resolution_m: info.resolution_m,
            voxels: info.voxels,
            filter: info.filter.map(Into::into),
        }
    }
}

impl From<FilterInfo> for JsonFilterInfo {
    fn from(info: FilterInfo) -> Self {
        Self {
            plane_bytes: info.plane_bytes,
            counter_bytes: info.counter_bytes,
            expected_false_positive_rate: info.expected_rate,
            ideal_false_positive_rate: info.ideal_false_positive_rate,
            measured_false_positive_rate: info.measured_rate,
        }
    }
}
