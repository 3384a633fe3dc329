//! Maps, their settings and their descriptions (`maps.proto`).

use std::time::{Duration, SystemTime};

use super::pb;
use super::scan::verdict_from;
use super::values::{InField, count_from, required};
use mrol_map::bloom::FilterSettings;
use mrol_map::map::{FilterInfo, LEVELS_DEFAULT, LevelInfo, MapName, MapOrigin, MapSettings, RobotName};
use mrol_map::mapping::Sighting;
use mrol_map::util::Durations;
use mrol_service::{
    MapElsewhere, MapHolder, MapInfo, MapList, MapStorage, Reason, ServiceError, UnavailableMap,
};
use mrol_store::JournalUse;

/// The name and settings of a map to make; `filter` fills in what the request leaves to the server.
///
/// # Errors
/// When the name is none, the settings are missing, or they have a filter and none.
pub fn create_map(
    request: pb::CreateMapRequest,
    filter: FilterSettings,
) -> Result<(MapName, MapSettings), ServiceError> {
    let settings = required(request.settings, "settings")?;
    Ok((MapName::new(&request.map)?, settings_from(&settings, filter)?))
}

fn settings_from(settings: &pb::MapSettings, default: FilterSettings) -> Result<MapSettings, ServiceError> {
    let filter = match (settings.no_filter, settings.filter) {
        (true, None) => None,
        (true, Some(_)) => {
            let message = "settings.filter and settings.no_filter are given: leave one out".to_owned();
            return Err(ServiceError::new(Reason::UnexpectedField, message));
        }
        (false, filter) => Some(filter_from(filter.unwrap_or_default(), default)),
    };
    Ok(MapSettings {
        resolution_m: settings.resolution_m,
        levels: settings.levels.unwrap_or(LEVELS_DEFAULT),
        filter,
        moments: settings.moments.unwrap_or(true),
        origin: settings.origin_m.map(|origin| MapOrigin { position_m: origin.into() }),
    })
}

fn filter_from(filter: pb::FilterSettings, default: FilterSettings) -> FilterSettings {
    FilterSettings {
        hashes: filter.hashes.unwrap_or(default.hashes),
        bits_per_key: filter.bits_per_key.unwrap_or(default.bits_per_key),
    }
}

impl From<FilterSettings> for pb::FilterSettings {
    fn from(FilterSettings { hashes, bits_per_key }: FilterSettings) -> Self {
        Self { hashes: Some(hashes), bits_per_key: Some(bits_per_key) }
    }
}

impl From<MapSettings> for pb::MapSettings {
    fn from(settings: MapSettings) -> Self {
        Self {
            resolution_m: settings.resolution_m,
            levels: Some(settings.levels),
            filter: settings.filter.map(Into::into),
            no_filter: settings.filter.is_none(),
            moments: Some(settings.moments),
            origin_m: settings.origin.map(|origin| origin.position_m.into()),
        }
    }
}

impl From<(&MapName, MapSettings)> for pb::CreateMapRequest {
    fn from((map, settings): (&MapName, MapSettings)) -> Self {
        Self { map: map.to_string(), settings: Some(settings.into()) }
    }
}

impl From<(MapInfo, bool)> for pb::CreateMapResponse {
    fn from((info, created): (MapInfo, bool)) -> Self {
        Self { map: Some(info.into()), created }
    }
}

impl TryFrom<pb::CreateMapResponse> for (MapInfo, bool) {
    type Error = ServiceError;

    fn try_from(answer: pb::CreateMapResponse) -> Result<Self, ServiceError> {
        Ok((required(answer.map, "map")?.try_into()?, answer.created))
    }
}

impl From<MapInfo> for pb::GetMapResponse {
    fn from(info: MapInfo) -> Self {
        Self { map: Some(info.into()) }
    }
}

impl TryFrom<pb::GetMapResponse> for MapInfo {
    type Error = ServiceError;

    fn try_from(answer: pb::GetMapResponse) -> Result<Self, ServiceError> {
        required(answer.map, "map")?.try_into()
    }
}

impl TryFrom<pb::RenameMapResponse> for MapInfo {
    type Error = ServiceError;

    fn try_from(answer: pb::RenameMapResponse) -> Result<Self, ServiceError> {
        required(answer.map, "map")?.try_into()
    }
}

impl TryFrom<pb::RestoreMapResponse> for MapInfo {
    type Error = ServiceError;

    fn try_from(answer: pb::RestoreMapResponse) -> Result<Self, ServiceError> {
        required(answer.map, "map")?.try_into()
    }
}

impl From<MapList> for pb::ListMapsResponse {
    fn from(MapList { maps, unavailable, elsewhere }: MapList) -> Self {
        let message = |UnavailableMap { name, reason }| pb::UnavailableMap { map: name.to_string(), reason };
        Self {
            maps: maps.into_iter().map(Into::into).collect(),
            unavailable: unavailable.into_iter().map(message).collect(),
            elsewhere: elsewhere.into_iter().map(Into::into).collect(),
        }
    }
}

impl TryFrom<pb::ListMapsResponse> for MapList {
    type Error = ServiceError;

    fn try_from(answer: pb::ListMapsResponse) -> Result<Self, ServiceError> {
        let pb::ListMapsResponse { maps, unavailable, elsewhere } = answer;
        Ok(Self {
            maps: maps.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            unavailable: unavailable.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            elsewhere: elsewhere.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
        })
    }
}

impl TryFrom<pb::UnavailableMap> for UnavailableMap {
    type Error = ServiceError;

    fn try_from(pb::UnavailableMap { map, reason }: pb::UnavailableMap) -> Result<Self, ServiceError> {
        Ok(Self { name: MapName::new(&map)?, reason })
    }
}

impl From<MapElsewhere> for pb::MapElsewhere {
    fn from(MapElsewhere { name, holders }: MapElsewhere) -> Self {
        let message = |MapHolder { node, http, grpc }| pb::MapHolder { node, http, grpc };
        Self { map: name.to_string(), holders: holders.into_iter().map(message).collect() }
    }
}

impl TryFrom<pb::MapElsewhere> for MapElsewhere {
    type Error = ServiceError;

    fn try_from(pb::MapElsewhere { map, holders }: pb::MapElsewhere) -> Result<Self, ServiceError> {
        let holder = |pb::MapHolder { node, http, grpc }| MapHolder { node, http, grpc };
        Ok(Self { name: MapName::new(&map)?, holders: holders.into_iter().map(holder).collect() })
    }
}

impl From<MapInfo> for pb::MapInfo {
    fn from(info: MapInfo) -> Self {
        Self {
            map: info.name.to_string(),
            version: Some(info.version.into()),
            settings: Some(info.settings.into()),
            levels: info.levels.iter().map(Into::into).collect(),
            scans: info.scans as u64,
            poses: Some(info.poses as u64),
            robots: info.robots.iter().map(ToString::to_string).collect(),
            sightings: info.sightings.iter().map(Into::into).collect(),
            set_bytes: info.set_bytes as u64,
            storage: info.storage.map(Into::into),
            moment_bytes: info.moment_bytes as u64,
            trajectory_bytes: info.trajectory_bytes as u64,
            viewpoints: info.viewpoints as u64,
            viewpoint_bytes: info.viewpoint_bytes as u64,
            asleep: info.is_asleep,
        }
    }
}

impl TryFrom<pb::MapInfo> for MapInfo {
    type Error = ServiceError;

    fn try_from(info: pb::MapInfo) -> Result<Self, ServiceError> {
        let settings = required(info.settings, "map.settings")?;
        let settings = settings_from(&settings, FilterSettings::default()).in_field("map")?;
        let level = |level: &pb::LevelInfo| LevelInfo {
            filter: settings.filter.map(|_| level.into()),
            ..level_without_filter(level)
        };
        let robots = info.robots.iter().map(|robot| RobotName::new(robot)).collect::<Result<_, _>>();
        Ok(Self {
            name: MapName::new(&info.map)?,
            version: required(info.version, "map.version")?.try_into()?,
            settings,
            levels: info.levels.iter().map(level).collect(),
            scans: count_from(info.scans),
            poses: count_from(info.poses.unwrap_or(info.scans)),
            robots: robots.in_field("map.robots")?,
            sightings: info.sightings.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            set_bytes: count_from(info.set_bytes),
            commits: Durations::default(),
            storage: info.storage.map(Into::into),
            moment_bytes: count_from(info.moment_bytes),
            trajectory_bytes: count_from(info.trajectory_bytes),
            viewpoints: count_from(info.viewpoints),
            viewpoint_bytes: count_from(info.viewpoint_bytes),
            is_asleep: info.asleep,
        })
    }
}

impl From<&Sighting> for pb::RobotSighting {
    fn from(sighting: &Sighting) -> Self {
        Self {
            robot: sighting.robot.to_string(),
            seen_at_ns: nanoseconds(sighting.seen_at),
            timestamp_ns: sighting.timestamp_ns,
            map_from_sensor: Some((&sighting.map_from_sensor).into()),
            verdict: pb::Verdict::from(sighting.verdict).into(),
            stationary: sighting.is_stationary,
        }
    }
}

impl TryFrom<pb::RobotSighting> for Sighting {
    type Error = ServiceError;

    fn try_from(sighting: pb::RobotSighting) -> Result<Self, ServiceError> {
        let since_epoch = Duration::from_nanos(u64::try_from(sighting.seen_at_ns).unwrap_or(0));
        let map_from_sensor = required(sighting.map_from_sensor, "map.sightings.map_from_sensor")?;
        Ok(Self {
            robot: RobotName::new(&sighting.robot).in_field("map.sightings.robot")?,
            seen_at: SystemTime::UNIX_EPOCH + since_epoch,
            timestamp_ns: sighting.timestamp_ns,
            map_from_sensor: map_from_sensor.try_into().in_field("map.sightings.map_from_sensor")?,
            verdict: verdict_from(sighting.verdict)?,
            is_stationary: sighting.stationary,
        })
    }
}

/// Nanoseconds since the Unix epoch; 0 before it, and the largest number after 2262.
pub fn nanoseconds(time: SystemTime) -> i64 {
    let since_epoch = time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX)
}

impl From<MapStorage> for pb::MapStorage {
    fn from(storage: MapStorage) -> Self {
        Self {
            durable_revision: storage.durable_revision,
            snapshot_revision: storage.snapshot_revision,
            undo_from_revision: storage.undo_from_revision,
            read_only: storage.failure.unwrap_or_default(),
        }
    }
}

impl From<pb::MapStorage> for MapStorage {
    fn from(storage: pb::MapStorage) -> Self {
        Self {
            durable_revision: storage.durable_revision,
            snapshot_revision: storage.snapshot_revision,
            undo_from_revision: storage.undo_from_revision,
            journal: JournalUse::default(),
            snapshot_age: Duration::ZERO,
            snapshot_failures: 0,
            disk_bytes: 0,
            failure: (!storage.read_only.is_empty()).then_some(storage.read_only),
        }
    }
}

impl From<&LevelInfo> for pb::LevelInfo {
    fn from(info: &LevelInfo) -> Self {
        let filter = info.filter.unwrap_or_default();
        Self {
            level: info.level,
            resolution_m: info.resolution_m,
            voxels: info.voxels as u64,
            plane_bytes: filter.plane_bytes as u64,
            counter_bytes: filter.counter_bytes as u64,
            expected_false_positive_rate: filter.expected_rate,
            ideal_false_positive_rate: filter.ideal_false_positive_rate,
            measured_false_positive_rate: filter.measured_rate,
        }
    }
}

fn level_without_filter(info: &pb::LevelInfo) -> LevelInfo {
    let pb::LevelInfo { level, resolution_m, voxels, .. } = *info;
    LevelInfo { level, resolution_m, voxels: count_from(voxels), filter: None }
}

impl From<&pb::LevelInfo> for FilterInfo {
    fn from(info: &pb::LevelInfo) -> Self {
        Self {
            plane_bytes: count_from(info.plane_bytes),
            counter_bytes: count_from(info.counter_bytes),
            expected_rate: info.expected_false_positive_rate,
            ideal_false_positive_rate: info.ideal_false_positive_rate,
            measured_rate: info.measured_false_positive_rate,
        }
    }
}
