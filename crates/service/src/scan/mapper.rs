//! How scans of a map are located and recorded, and how its lost robots are looked for.

use std::time::Duration;

use super::localization::search_settings;
use crate::limits::Limits;
use crate::maps::HostedMap;
use crate::settings::ServiceSettings;
use mrol_map::align::{AlignmentSettings, Method};
use mrol_map::mapping::{MappingSettings, RecoverySettings, ScanMapper, ViewpointSettings};

impl HostedMap {
    /// How scans of this map are located and recorded: by the method that a request asks for, and with an eye on lost
    /// robots where they are to be looked for.
    pub(super) fn mapper(
        &self,
        method: Option<Method>,
        recovers: bool,
        settings: &ServiceSettings,
    ) -> ScanMapper<'_> {
        let method = method.unwrap_or(settings.alignment.method);
        let alignment = AlignmentSettings { method, ..settings.alignment };
        let mapper = ScanMapper::new(
            &self.map,
            &self.robots.sightings,
            MappingSettings {
                alignment,
                stationary: Some(settings.stationary),
                viewpoints: ViewpointSettings {
                    bytes_max: settings.limits.viewpoint_bytes_max,
                    ..ViewpointSettings::default()
                },
                ..MappingSettings::default()
            },
        );
        match recovers {
            true => mapper.recovering(&self.robots.lost, recovery_settings(&settings.limits)),
            false => mapper,
        }
    }
}

/// How lost robots are looked for on a server.
fn recovery_settings(limits: &Limits) -> RecoverySettings {
    RecoverySettings {
        localization: search_settings(limits.localization_grid_bytes_max),
        keeps_tilt: true,
        search_interval: seconds(limits.recovery_search_interval_s),
        ..RecoverySettings::default()
    }
}

/// The duration of a limit, which is checked when the settings are read.
pub(super) fn seconds(limit_s: f64) -> Duration {
    Duration::from_secs_f64(limit_s)
}
