//! Bounds on what callers may ask.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::service::Limits;

/// The service's [`Limits`], and those of messages and connections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LimitsConfig {
    /// Bytes of one HTTP body or one gRPC message. 32 MiB.
    pub message_bytes_max: usize,
    /// Connections of HTTP, and as many of gRPC. Where all are in use another is closed at once; where one is idle, it
    /// gives way. 1024.
    pub connections_max: usize,
    /// Seconds until a connection has to be secure and to begin to speak. 10.
    pub connection_opening_max_s: f64,
    /// Seconds that an HTTP connection may stay without a request, or take for a request's headers. 30.
    pub http_idle_max_s: f64,
    /// Seconds that a gRPC connection may stay without a call. 600.
    pub grpc_idle_max_s: f64,
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
    /// See [`Limits::jobs_waiting_max`].
    pub jobs_waiting_max: usize,
    /// See [`Limits::map_file_bytes_max`].
    pub map_file_bytes_max: usize,
    /// See [`Limits::min_revision_wait_max`]; seconds.
    pub min_revision_wait_max_s: f64,
    /// See [`Limits::localization_time_max`]; seconds.
    pub localization_time_max_s: f64,
    /// See [`Limits::localization_candidates_max`].
    pub localization_candidates_max: usize,
    /// See [`Limits::localization_grid_bytes_max`].
    pub localization_grid_bytes_max: usize,
}

impl Default for LimitsConfig {
    fn default() -> Self {
        let limits = Limits::default();
        Self {
            message_bytes_max: crate::wire::transport::MESSAGE_BYTES_MAX,
            connections_max: 1024,
            connection_opening_max_s: 10.0,
            http_idle_max_s: 30.0,
            grpc_idle_max_s: 600.0,
            points_per_request_max: limits.points_per_request_max,
            keys_per_request_max: limits.keys_per_request_max,
            maps_max: limits.maps_max,
            voxels_per_map_max: limits.voxels_per_map_max,
            listed_voxels_max: limits.listed_voxels_max,
            jobs_waiting_max: limits.jobs_waiting_max,
            map_file_bytes_max: limits.map_file_bytes_max,
            min_revision_wait_max_s: limits.min_revision_wait_max.as_secs_f64(),
            localization_time_max_s: limits.localization_time_max.as_secs_f64(),
            localization_candidates_max: limits.localization_candidates_max,
            localization_grid_bytes_max: limits.localization_grid_bytes_max,
        }
    }
}

impl LimitsConfig {
    pub(super) fn service_limits(&self) -> Limits {
        Limits {
            points_per_request_max: self.points_per_request_max,
            keys_per_request_max: self.keys_per_request_max,
            maps_max: self.maps_max,
            voxels_per_map_max: self.voxels_per_map_max,
            listed_voxels_max: self.listed_voxels_max,
            jobs_waiting_max: self.jobs_waiting_max,
            map_file_bytes_max: self.map_file_bytes_max,
            min_revision_wait_max: Duration::from_secs_f64(self.min_revision_wait_max_s),
            localization_time_max: Duration::from_secs_f64(self.localization_time_max_s),
            localization_candidates_max: self.localization_candidates_max,
            localization_grid_bytes_max: self.localization_grid_bytes_max,
        }
    }
}
