//! Bounds on what callers may ask.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::ConfigError;
use crate::admission::AdmissionLimits;
use crate::service::{Limits, Marks};

/// The service's [`Limits`], and those of messages and connections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LimitsConfig {
    /// Bytes of one HTTP body or one gRPC message. 32 MiB.
    pub message_bytes_max: usize,
    /// Connections of HTTP, and as many of gRPC. Where all are in use another is closed at once; where one is idle, it
    /// gives way. More than twice `requests_max` and `streams_max`, so that there is always one. 2048.
    pub connections_max: usize,
    /// Connections of each protocol besides, where all of those are in use: for one health check each, and for
    /// `probe_time_max_s` at most. Where all of these are taken too, one that has its answer gives way, or one of the peer that
    /// has most. 128.
    pub connections_reserved: usize,
    /// Seconds until a connection has to be secure and to begin to speak. 10.
    pub connection_opening_max_s: f64,
    /// Seconds that an HTTP connection may stay without a request, or take for a request's headers. 30.
    pub http_idle_max_s: f64,
    /// Seconds that a gRPC connection may stay without a call. 600.
    pub grpc_idle_max_s: f64,
    /// See [`AdmissionLimits::requests_max`].
    pub requests_max: usize,
    /// See [`AdmissionLimits::streams_max`].
    pub streams_max: usize,
    /// See [`AdmissionLimits::body_bytes_max`].
    pub body_bytes_max: usize,
    /// See [`AdmissionLimits::body_silence_max`]; seconds.
    pub body_silence_max_s: f64,
    /// See [`AdmissionLimits::body_bytes_per_s_min`].
    pub body_bytes_per_s_min: u32,
    /// See [`AdmissionLimits::caller_requests_per_s_max`].
    pub caller_requests_per_s_max: u32,
    /// See [`AdmissionLimits::caller_burst_max`].
    pub caller_burst_max: u32,
    /// See [`AdmissionLimits::caller_requests_at_once_max`].
    pub caller_requests_at_once_max: u32,
    /// See [`AdmissionLimits::probes_max`].
    pub probes_max: usize,
    /// See [`AdmissionLimits::probe_body_bytes_max`].
    pub probe_body_bytes_max: usize,
    /// See [`AdmissionLimits::probe_time_max`]; seconds.
    pub probe_time_max_s: f64,
    /// See [`AdmissionLimits::scrapes_max`].
    pub scrapes_max: usize,
    /// See [`AdmissionLimits::scrape_kept`]; seconds.
    pub scrape_kept_s: f64,
    /// See [`AdmissionLimits::health_watches_max`].
    pub health_watches_max: usize,
    /// See [`AdmissionLimits::health_watch_max`]; seconds.
    pub health_watch_max_s: f64,
    /// See [`Limits::points_per_request_max`].
    pub points_per_request_max: usize,
    /// See [`Limits::keys_per_request_max`].
    pub keys_per_request_max: usize,
    /// See [`Limits::maps_max`].
    pub maps_max: usize,
    /// See [`Limits::voxels_per_map_max`].
    pub voxels_per_map_max: usize,
    /// See [`Limits::listed_voxels_max`].
    pub listed_voxels_max: usize,
    /// See [`Limits::trajectory_page_max`].
    pub trajectory_page_max: usize,
    /// See [`Limits::robots_per_map_max`].
    pub robots_per_map_max: usize,
    /// See [`Limits::jobs_waiting_max`].
    pub jobs_waiting_max: usize,
    /// See [`Limits::map_file_bytes_max`].
    pub map_file_bytes_max: usize,
    /// See [`Limits::map_file_scans_max`].
    pub map_file_scans_max: usize,
    /// See [`Limits::min_revision_wait_max`]; seconds.
    pub min_revision_wait_max_s: f64,
    /// See [`Limits::alignment_time_max`]; seconds.
    pub alignment_time_max_s: f64,
    /// See [`Limits::insertion_time_max`]; seconds.
    pub insertion_time_max_s: f64,
    /// See [`Limits::undo_time_max`]; seconds.
    pub undo_time_max_s: f64,
    /// See [`Limits::localization_time_max`]; seconds.
    pub localization_time_max_s: f64,
    /// See [`Limits::localization_candidates_max`].
    pub localization_candidates_max: usize,
    /// See [`Limits::localization_grid_bytes_max`].
    pub localization_grid_bytes_max: usize,
    /// MiB free on the disk of the data folder below which changes are refused; 0 = never. 256.
    pub disk_free_low_mib: u64,
    /// MiB free from which on they are taken again. 512.
    pub disk_free_resume_mib: u64,
    /// MiB of memory in use above which what makes maps grow is refused; 0 = 85 % of what the system or the control group
    /// allows. 0.
    pub memory_high_mib: u64,
    /// MiB at which it is taken again; 0 = 94 % of the high mark. 0.
    pub memory_resume_mib: u64,
}

impl Default for LimitsConfig {
    fn default() -> Self {
        let (limits, admission) = (Limits::default(), AdmissionLimits::default());
        Self {
            message_bytes_max: crate::wire::transport::MESSAGE_BYTES_MAX,
            connections_max: 2048,
            connections_reserved: 128,
            connection_opening_max_s: 10.0,
            http_idle_max_s: 30.0,
            grpc_idle_max_s: 600.0,
            requests_max: admission.requests_max,
            streams_max: admission.streams_max,
            body_bytes_max: admission.body_bytes_max,
            body_silence_max_s: admission.body_silence_max.as_secs_f64(),
            body_bytes_per_s_min: admission.body_bytes_per_s_min,
            caller_requests_per_s_max: admission.caller_requests_per_s_max,
            caller_burst_max: admission.caller_burst_max,
            caller_requests_at_once_max: admission.caller_requests_at_once_max,
            probes_max: admission.probes_max,
            probe_body_bytes_max: admission.probe_body_bytes_max,
            probe_time_max_s: admission.probe_time_max.as_secs_f64(),
            scrapes_max: admission.scrapes_max,
            scrape_kept_s: admission.scrape_kept.as_secs_f64(),
            health_watches_max: admission.health_watches_max,
            health_watch_max_s: admission.health_watch_max.as_secs_f64(),
            points_per_request_max: limits.points_per_request_max,
            keys_per_request_max: limits.keys_per_request_max,
            maps_max: limits.maps_max,
            voxels_per_map_max: limits.voxels_per_map_max,
            listed_voxels_max: limits.listed_voxels_max,
            trajectory_page_max: limits.trajectory_page_max,
            robots_per_map_max: limits.robots_per_map_max,
            jobs_waiting_max: limits.jobs_waiting_max,
            map_file_bytes_max: limits.map_file_bytes_max,
            map_file_scans_max: limits.map_file_scans_max,
            min_revision_wait_max_s: limits.min_revision_wait_max.as_secs_f64(),
            alignment_time_max_s: limits.alignment_time_max.as_secs_f64(),
            insertion_time_max_s: limits.insertion_time_max.as_secs_f64(),
            undo_time_max_s: limits.undo_time_max.as_secs_f64(),
            localization_time_max_s: limits.localization_time_max.as_secs_f64(),
            localization_candidates_max: limits.localization_candidates_max,
            localization_grid_bytes_max: limits.localization_grid_bytes_max,
            disk_free_low_mib: limits.marks.disk_free_low_bytes >> 20,
            disk_free_resume_mib: limits.marks.disk_free_resume_bytes >> 20,
            memory_high_mib: 0,
            memory_resume_mib: 0,
        }
    }
}

impl LimitsConfig {
    /// Bounds on all requests together.
    pub fn admission(&self) -> AdmissionLimits {
        AdmissionLimits {
            requests_max: self.requests_max,
            streams_max: self.streams_max,
            body_bytes_max: self.body_bytes_max,
            body_silence_max: Duration::from_secs_f64(self.body_silence_max_s),
            body_bytes_per_s_min: self.body_bytes_per_s_min,
            caller_requests_per_s_max: self.caller_requests_per_s_max,
            caller_burst_max: self.caller_burst_max,
            caller_requests_at_once_max: self.caller_requests_at_once_max,
            probes_max: self.probes_max,
            probe_body_bytes_max: self.probe_body_bytes_max,
            probe_time_max: Duration::from_secs_f64(self.probe_time_max_s),
            scrapes_max: self.scrapes_max,
            scrape_kept: Duration::from_secs_f64(self.scrape_kept_s),
            health_watches_max: self.health_watches_max,
            health_watch_max: Duration::from_secs_f64(self.health_watch_max_s),
        }
    }

    /// Refuses numbers that would stop the server from working at all.
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let range = |key, range, value: String| Err(ConfigError::Range { key, range, value });
        if self.message_bytes_max == 0 {
            return range("limits.message_bytes_max", "at least 1", "0".into());
        }
        for (key, value, least, allowed) in [
            ("limits.requests_max", self.requests_max, 1, "1 to 1048576"),
            ("limits.streams_max", self.streams_max, 1, "1 to 1048576"),
            ("limits.trajectory_page_max", self.trajectory_page_max, 1, "1 to 1048576"),
            ("limits.robots_per_map_max", self.robots_per_map_max, 1, "1 to 1048576"),
            ("limits.jobs_waiting_max", self.jobs_waiting_max, 0, "0 to 1048576"),
            ("limits.probes_max", self.probes_max, 1, "1 to 1048576"),
            ("limits.probe_body_bytes_max", self.probe_body_bytes_max, 64, "64 to 1048576"),
            ("limits.scrapes_max", self.scrapes_max, 1, "1 to 1048576"),
            ("limits.health_watches_max", self.health_watches_max, 0, "0 to 1048576"),
            ("limits.connections_reserved", self.connections_reserved, 0, "0 to 1048576"),
        ] {
            if !(least..=1 << 20).contains(&value) {
                return range(key, allowed, value.to_string());
            }
        }
        for (key, seconds) in [
            ("limits.min_revision_wait_max_s", self.min_revision_wait_max_s),
            ("limits.alignment_time_max_s", self.alignment_time_max_s),
            ("limits.insertion_time_max_s", self.insertion_time_max_s),
            ("limits.undo_time_max_s", self.undo_time_max_s),
            ("limits.localization_time_max_s", self.localization_time_max_s),
            ("limits.connection_opening_max_s", self.connection_opening_max_s),
            ("limits.http_idle_max_s", self.http_idle_max_s),
            ("limits.grpc_idle_max_s", self.grpc_idle_max_s),
            ("limits.body_silence_max_s", self.body_silence_max_s),
            ("limits.probe_time_max_s", self.probe_time_max_s),
            ("limits.scrape_kept_s", self.scrape_kept_s),
            ("limits.health_watch_max_s", self.health_watch_max_s),
        ] {
            if !(0.0..=86_400.0).contains(&seconds) {
                return range(key, "0 to 86400", seconds.to_string());
            }
        }
        if self.body_bytes_max < self.message_bytes_max {
            let least = "at least limits.message_bytes_max";
            return range("limits.body_bytes_max", least, self.body_bytes_max.to_string());
        }
        // Each request may be on a connection of its own, in work or arriving, and each stream.
        if self.connections_max <= 2 * self.requests_max + self.streams_max {
            let least = "more than twice limits.requests_max and limits.streams_max";
            return range("limits.connections_max", least, self.connections_max.to_string());
        }
        self.check_marks()
    }

    /// The same limits for a process that may have so many bytes in memory, if that is known: what may lie in bodies, be
    /// restored or be searched in at once is an eighth of that at most.
    pub fn within_memory(self, allowed_bytes: Option<u64>) -> Self {
        let share =
            allowed_bytes.map_or(usize::MAX, |bytes| usize::try_from(bytes / 8).unwrap_or(usize::MAX));
        Self {
            body_bytes_max: self.body_bytes_max.min(share.max(self.message_bytes_max)),
            map_file_bytes_max: self.map_file_bytes_max.min(share),
            localization_grid_bytes_max: self.localization_grid_bytes_max.min(share),
            ..self
        }
    }

    pub(super) fn service_limits(&self) -> Limits {
        Limits {
            points_per_request_max: self.points_per_request_max,
            keys_per_request_max: self.keys_per_request_max,
            maps_max: self.maps_max,
            voxels_per_map_max: self.voxels_per_map_max,
            listed_voxels_max: self.listed_voxels_max,
            trajectory_page_max: self.trajectory_page_max,
            robots_per_map_max: self.robots_per_map_max,
            jobs_waiting_max: self.jobs_waiting_max,
            map_file_bytes_max: self.map_file_bytes_max,
            map_file_scans_max: self.map_file_scans_max,
            min_revision_wait_max: Duration::from_secs_f64(self.min_revision_wait_max_s),
            alignment_time_max: Duration::from_secs_f64(self.alignment_time_max_s),
            insertion_time_max: Duration::from_secs_f64(self.insertion_time_max_s),
            undo_time_max: Duration::from_secs_f64(self.undo_time_max_s),
            localization_time_max: Duration::from_secs_f64(self.localization_time_max_s),
            localization_candidates_max: self.localization_candidates_max,
            localization_grid_bytes_max: self.localization_grid_bytes_max,
            marks: self.marks(),
        }
    }

    fn marks(&self) -> Marks {
        let given = |mib: u64| (mib > 0).then_some(mib << 20);
        Marks {
            disk_free_low_bytes: self.disk_free_low_mib << 20,
            disk_free_resume_bytes: self.disk_free_resume_mib << 20,
            memory_high_bytes: given(self.memory_high_mib),
            memory_resume_bytes: given(self.memory_resume_mib),
        }
    }

    /// Refuses marks with nothing between them, and those that no system has.
    fn check_marks(&self) -> Result<(), ConfigError> {
        let range = |key, range, value: u64| Err(ConfigError::Range { key, range, value: value.to_string() });
        for (key, mib) in [
            ("limits.disk_free_low_mib", self.disk_free_low_mib),
            ("limits.disk_free_resume_mib", self.disk_free_resume_mib),
            ("limits.memory_high_mib", self.memory_high_mib),
            ("limits.memory_resume_mib", self.memory_resume_mib),
        ] {
            if mib > 1 << 40 {
                return range(key, "0 to 1099511627776", mib);
            }
        }
        if self.disk_free_resume_mib <= self.disk_free_low_mib {
            let more = "more than limits.disk_free_low_mib";
            return range("limits.disk_free_resume_mib", more, self.disk_free_resume_mib);
        }
        match (self.memory_high_mib, self.memory_resume_mib) {
            (_, 0) => Ok(()),
            (0, _) => {
                Err(ConfigError::Missing { needed: "limits.memory_high_mib", by: "limits.memory_resume_mib" })
            }
            (high, back) if back >= high => {
                range("limits.memory_resume_mib", "less than limits.memory_high_mib", back)
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_lie_within_a_day() {
        type Set = fn(&mut LimitsConfig, f64);
        let times: [(&str, Set); 3] = [
            ("limits.alignment_time_max_s", |limits, seconds| limits.alignment_time_max_s = seconds),
            ("limits.insertion_time_max_s", |limits, seconds| limits.insertion_time_max_s = seconds),
            ("limits.undo_time_max_s", |limits, seconds| limits.undo_time_max_s = seconds),
        ];
        for (name, set) in times {
            for (seconds, is_fine) in
                [(0.0, true), (86_400.0, true), (86_400.1, false), (-0.1, false), (f64::NAN, false)]
            {
                let mut limits = LimitsConfig::default();
                set(&mut limits, seconds);
                let checked = limits.check();
                assert_eq!(checked.is_ok(), is_fine, "{name} {seconds}");
                assert!(checked.is_ok() || checked.unwrap_err().to_string().contains(name));
            }
        }
    }

    #[test]
    fn what_lies_in_memory_for_a_while_is_an_eighth_of_what_there_is_at_most() {
        let limits = LimitsConfig::default();
        assert_eq!(limits.clone().within_memory(None), limits);
        assert_eq!(limits.clone().within_memory(Some(16 << 30)), limits);
        let small = limits.clone().within_memory(Some(512 << 20));
        assert_eq!((small.body_bytes_max, small.map_file_bytes_max), (64 << 20, 64 << 20));
        assert_eq!(small.localization_grid_bytes_max, 64 << 20);
        // One message must have room.
        assert_eq!(limits.clone().within_memory(Some(64 << 20)).body_bytes_max, limits.message_bytes_max);
    }
}
