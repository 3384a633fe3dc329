//! Every limit of the server, by name, with its default.

#[cfg(feature = "server")]
use serde::{Deserialize, Serialize};

use super::{Reason, ServiceError};
use crate::map::{KEEP_OUTS_MAX, PRISM_CORNERS_MAX};
use crate::planning::FIELD_BYTES_MAX_DEFAULT;

/// The limits of the server: on what callers may ask, on what is done at once, and on what the machine has. Each is named
/// in the error of a request beyond it, and is a setting of the section `limits`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "server", derive(Serialize, Deserialize), serde(default, deny_unknown_fields))]
pub struct Limits {
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
    /// Requests in work, and as many whose bodies are arriving. 512.
    pub requests_max: usize,
    /// Calls whose client streams messages. 256.
    pub streams_max: usize,
    /// Bytes of bodies that have arrived, of what streams keep of them, and of answers, listings and files that are being
    /// sent. 1 GiB.
    pub body_bytes_max: usize,
    /// How long a body may be silent before its end. 30 s.
    pub body_silence_max_s: f64,
    /// Bytes a second of a body that comes in time; what comes more slowly counts as silent for the time that its bytes
    /// do not account for. 0 = any byte will do. 1024.
    pub body_bytes_per_s_min: u32,
    /// Requests and messages of streams a second of one caller: of a key, or of an address where there is none;
    /// 0 = any number. 0.
    pub caller_requests_per_s_max: u32,
    /// As many may come at once. 100.
    pub caller_burst_max: u32,
    /// Requests and streams in work at a time of one key that says nothing of that itself; 0 = any number. Less than half of
    /// `requests_max`, so that no key keeps the others out. 192.
    pub caller_requests_at_once_max: u32,
    /// Health checks that are arriving, and as many that are answered, over each protocol. Where all places are taken,
    /// the oldest gives way. 64.
    pub probes_max: usize,
    /// Bytes of the body of a health check, which comes as it is: nothing is inflated. 1 KiB.
    pub probe_body_bytes_max: usize,
    /// How long the body of a health check may take. 5 s.
    pub probe_time_max_s: f64,
    /// Scrapes of the metrics that wait or are being read. 16.
    pub scrapes_max: usize,
    /// How long the text of a scrape answers those that follow. 1 s.
    pub scrape_kept_s: f64,
    /// Calls of `grpc.health.v1.Health/Watch`, one a connection. 16.
    pub health_watches_max: usize,
    /// How long a health watch lasts that came without a key, seconds. 600.
    pub health_watch_max_s: f64,
    /// Watches of maps at once, over both protocols. 256.
    pub watches_max: usize,
    /// Longest time between two messages of a watch, where nothing changes. 10 s.
    pub watch_heartbeat_s: f64,
    /// How long a watch's client may take no message, until the watch ends. 30 s.
    pub watch_unread_max_s: f64,
    /// Points of one query, deletion or scan, or rays of one question. 2,000,000.
    pub points_per_request_max: usize,
    /// How far the time of a scan's point may lie from the scan's timestamp. 2 s.
    pub point_times_max_s: f64,
    /// Keys of one deletion. 2,000,000.
    pub keys_per_request_max: usize,
    /// Maps at once. 64.
    pub maps_max: usize,
    /// Finest voxels of one map. 200,000,000.
    pub voxels_per_map_max: usize,
    /// Voxels that one listing may return. 20,000,000.
    pub listed_voxels_max: usize,
    /// Links, spheres and points, in all, of a body that is checked, and spheres of a group that is checked as one. A body has
    /// 65,536 links at most, whatever this is. 16,384.
    pub body_parts_max: usize,
    /// Regions in which a check ignores voxels. A message has 4,096 at most, whatever this is. 64.
    pub ignored_regions_max: usize,
    /// Bytes of the distance fields that a map keeps for checks of bodies. Less is slower and as exact: the oldest part goes.
    /// 128 MiB.
    pub planning_field_bytes_max: usize,
    /// How long a question of a planner may take, while changes of the map wait for it. 0.5 s.
    pub question_time_max_s: f64,
    /// Cells of one 2-D grid. 4,000,000.
    pub grid_cells_max: usize,
    /// Bytes of a block that is given out: one a cell of a dense one, 72 for 8 x 8 x 8 voxels of another. 16 MiB.
    pub block_bytes_max: usize,
    /// Cells of a dense block and as far around it as its distances go. 67,108,864.
    pub block_cells_max: usize,
    /// Scans that one list of those that touched a voxel has at most, the newest. 100.
    pub observers_max: usize,
    /// How long the journal is looked through for the scans that touched a voxel. 10 s.
    pub observers_time_max_s: f64,
    /// Poses of one page of a trajectory, and of one that is asked for without a limit. 5,000.
    pub trajectory_page_max: usize,
    /// Keep-outs of one map. 256, which is also the most.
    pub keep_outs_max: usize,
    /// Comparisons of points with the sides of keep-outs in one query: points times corners, a shape without corners counting as
    /// one. 400,000,000, some seconds.
    pub keep_out_tests_max: usize,
    /// Corners of a keep-out that is a prism. 64, which is also the most.
    pub keep_out_corners_max: usize,
    /// Robots of which one map keeps scans, or ids of scans. 4,096.
    pub robots_per_map_max: usize,
    /// Jobs that may wait for a query thread, and as many for a thread of each other pool. 256.
    pub jobs_waiting_max: usize,
    /// Bytes of a map file that is restored, before and after compression. 1 GiB.
    pub map_file_bytes_max: usize,
    /// Scans of a map file that is restored, and as many that were taken out again. 20,000,000.
    pub map_file_scans_max: usize,
    /// How long a read waits for `min_revision` at most; the caller's deadline may end it sooner. 10 s.
    pub min_revision_wait_max_s: f64,
    /// How long aligning a scan may take that is not inserted. 10 s.
    pub alignment_time_max_s: f64,
    /// How long aligning and preparing a scan may take that is to be inserted. 30 s.
    pub insertion_time_max_s: f64,
    /// How long finding out may take what an undo takes back. 60 s.
    pub undo_time_max_s: f64,
    /// How long a search with no guess may take. 60 s.
    pub localization_time_max_s: f64,
    /// How long a search for a lost robot may take. 2 s.
    pub recovery_search_time_max_s: f64,
    /// Shortest time from one search for a lost robot to the next for the same one. 2 s.
    pub recovery_search_interval_s: f64,
    /// Candidates of one search, which keeps that many places. 16.
    pub localization_candidates_max: usize,
    /// Memory for the dilated levels of one search; a map that takes more is searched at a coarser resolution, or in
    /// a box. 512 MiB.
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

impl Default for Limits {
    fn default() -> Self {
        Self {
            message_bytes_max: Self::MESSAGE_BYTES_MAX,
            connections_max: 2048,
            connections_reserved: 128,
            connection_opening_max_s: 10.0,
            http_idle_max_s: 30.0,
            grpc_idle_max_s: 600.0,
            requests_max: 512,
            streams_max: 256,
            body_bytes_max: 1 << 30,
            body_silence_max_s: 30.0,
            body_bytes_per_s_min: 1024,
            caller_requests_per_s_max: 0,
            caller_burst_max: 100,
            caller_requests_at_once_max: 192,
            probes_max: 64,
            probe_body_bytes_max: 1 << 10,
            probe_time_max_s: 5.0,
            scrapes_max: 16,
            scrape_kept_s: 1.0,
            health_watches_max: 16,
            health_watch_max_s: 600.0,
            watches_max: 256,
            watch_heartbeat_s: 10.0,
            watch_unread_max_s: 30.0,
            points_per_request_max: 2_000_000,
            point_times_max_s: 2.0,
            keys_per_request_max: 2_000_000,
            maps_max: 64,
            voxels_per_map_max: 200_000_000,
            listed_voxels_max: 20_000_000,
            body_parts_max: 16_384,
            ignored_regions_max: 64,
            planning_field_bytes_max: FIELD_BYTES_MAX_DEFAULT,
            question_time_max_s: 0.5,
            grid_cells_max: 4_000_000,
            block_bytes_max: 16 << 20,
            block_cells_max: 64 << 20,
            observers_max: 100,
            observers_time_max_s: 10.0,
            trajectory_page_max: 5_000,
            keep_outs_max: KEEP_OUTS_MAX,
            keep_out_tests_max: 400_000_000,
            keep_out_corners_max: PRISM_CORNERS_MAX,
            robots_per_map_max: 4_096,
            jobs_waiting_max: 256,
            map_file_bytes_max: 1 << 30,
            map_file_scans_max: 20_000_000,
            min_revision_wait_max_s: 10.0,
            alignment_time_max_s: 10.0,
            insertion_time_max_s: 30.0,
            undo_time_max_s: 60.0,
            localization_time_max_s: 60.0,
            recovery_search_time_max_s: 2.0,
            recovery_search_interval_s: 2.0,
            localization_candidates_max: 16,
            localization_grid_bytes_max: 512 << 20,
            disk_free_low_mib: 256,
            disk_free_resume_mib: 512,
            memory_high_mib: 0,
            memory_resume_mib: 0,
        }
    }
}

impl Limits {
    /// Bytes of one message where nothing is set.
    pub const MESSAGE_BYTES_MAX: usize = 32 << 20;
    /// Bytes of a message besides those of a block, at most.
    const BESIDE_BLOCK_BYTES: usize = 1 << 10;

    /// These limits for a process that may have so many bytes in memory, if that is known: what may lie in bodies, be
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

    /// Where changes are refused for want of disk or memory.
    pub(crate) fn marks(&self) -> Marks {
        let given = |mib: u64| (mib > 0).then_some(mib << 20);
        Marks {
            disk_free_low_bytes: self.disk_free_low_mib << 20,
            disk_free_resume_bytes: self.disk_free_resume_mib << 20,
            memory_high_bytes: given(self.memory_high_mib),
            memory_resume_bytes: given(self.memory_resume_mib),
        }
    }

    /// # Errors
    /// When a request has no point, or more than `points_per_request_max`.
    pub(super) fn check_points(&self, points: usize) -> Result<(), ServiceError> {
        within("points", "points_per_request_max", points, self.points_per_request_max)
    }

    /// # Errors
    /// When a request has no element of `field`, such as rays, or more than `points_per_request_max`.
    pub(super) fn check_elements(&self, field: &str, elements: usize) -> Result<(), ServiceError> {
        within(field, "points_per_request_max", elements, self.points_per_request_max)
    }

    /// # Errors
    /// When a request has no key, or more than `keys_per_request_max`.
    pub(super) fn check_keys(&self, keys: usize) -> Result<(), ServiceError> {
        within("keys", "keys_per_request_max", keys, self.keys_per_request_max)
    }

    /// # Errors
    /// When the body of a question has more links, spheres and points in all than `body_parts_max`.
    pub(crate) fn check_body_parts(&self, parts: usize) -> Result<(), ServiceError> {
        let most = self.body_parts_max;
        if parts <= most {
            return Ok(());
        }
        let message = format!("body has {parts} links, spheres and points, body_parts_max is {most}");
        Err(ServiceError::new(Reason::BatchTooLarge, message))
    }

    /// # Errors
    /// When one of the groups, of so many spheres each, has more than `body_parts_max`.
    pub(super) fn check_group_sizes(&self, sizes: &[u32]) -> Result<(), ServiceError> {
        let most = self.body_parts_max;
        let Some((i, size)) = sizes.iter().enumerate().find(|(_, size)| **size as usize > most) else {
            return Ok(());
        };
        let message = format!("sizes[{i}] has {size} spheres, body_parts_max is {most}");
        Err(ServiceError::new(Reason::BatchTooLarge, message))
    }

    /// # Errors
    /// When a query of so many points would be compared with more sides of keep-outs than `keep_out_tests_max` in all.
    pub(super) fn check_keep_out_tests(&self, points: usize, sides: usize) -> Result<(), ServiceError> {
        let most = self.keep_out_tests_max;
        if points.saturating_mul(sides) <= most {
            return Ok(());
        }
        let message = format!(
            "points: {points} of them compared with {sides} sides of keep-outs are more than keep_out_tests_max, {most}: ask for \
             at most {}",
            most / sides.max(1)
        );
        Err(ServiceError::new(Reason::BatchTooLarge, message))
    }

    /// # Errors
    /// When the prism of a keep-out has more corners than `keep_out_corners_max`.
    pub(super) fn check_corners(&self, corners: usize) -> Result<(), ServiceError> {
        let most = self.keep_out_corners_max;
        if corners <= most {
            return Ok(());
        }
        let message = format!("prism.corners_m has {corners} corners, keep_out_corners_max is {most}");
        Err(ServiceError::new(Reason::BadKeepOut, message))
    }

    /// The bytes that a block may have, and the limit that says so: one message has to hold it.
    pub(super) fn block_bytes(&self) -> (usize, &'static str) {
        let message = self.message_bytes_max.saturating_sub(Self::BESIDE_BLOCK_BYTES);
        match self.block_bytes_max <= message {
            true => (self.block_bytes_max, "block_bytes_max"),
            false => (message, "message_bytes_max, less 1 KiB,"),
        }
    }

    /// # Errors
    /// When a block is larger than it may be.
    pub(super) fn check_block_bytes(&self, bytes: usize) -> Result<(), ServiceError> {
        let (most, limit) = self.block_bytes();
        if bytes <= most {
            return Ok(());
        }
        let message = format!(
            "the block has {bytes} bytes or more, {limit} is {most}: ask for a smaller part or a coarser level"
        );
        Err(ServiceError::new(Reason::BlockTooLarge, message))
    }

    /// The poses of a page, where `limit` of them are asked for.
    ///
    /// # Errors
    /// When these are none, or more than `trajectory_page_max`.
    pub(super) fn page(&self, limit: Option<usize>) -> Result<usize, ServiceError> {
        let most = self.trajectory_page_max;
        match limit {
            None => Ok(most),
            Some(limit) if (1..=most).contains(&limit) => Ok(limit),
            Some(limit) => {
                let message = format!(
                    "limit must be 1 to trajectory_page_max, which is {most}, got {limit}: ask for the next page by \
                     since_revision"
                );
                Err(ServiceError::new(Reason::PageTooLarge, message))
            }
        }
    }
}

/// Where changes are refused, and where they are taken again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Marks {
    /// With fewer bytes free on the disk of the data folder, changes are refused; 0 = never. 256 MiB.
    pub disk_free_low_bytes: u64,
    /// With that many bytes free, changes are taken again. 512 MiB.
    pub disk_free_resume_bytes: u64,
    /// With more bytes of memory in use, what makes maps grow is refused; without, 85 % of what the process may use.
    pub memory_high_bytes: Option<u64>,
    /// With at most that many in use it is taken again; without, 94 % of the high mark.
    pub memory_resume_bytes: Option<u64>,
}

impl Default for Marks {
    fn default() -> Self {
        Limits::default().marks()
    }
}

fn within(field: &str, limit: &str, count: usize, most: usize) -> Result<(), ServiceError> {
    match count {
        0 => Err(ServiceError::new(Reason::EmptyBatch, format!("{field} must not be empty"))),
        n if n > most => Err(ServiceError::new(
            Reason::BatchTooLarge,
            format!("{field} has {n} entries, {limit} is {most}"),
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_bounded_on_both_sides_and_the_error_names_the_limit() {
        let limits = Limits { trajectory_page_max: 10, ..Limits::default() };
        assert_eq!([None, Some(10), Some(1)].map(|limit| limits.page(limit).unwrap()), [10, 10, 1]);
        for bad in [0, 11] {
            let error = limits.page(Some(bad)).unwrap_err();
            assert!(
                error.message.contains(&format!("trajectory_page_max, which is 10, got {bad}")),
                "{error}"
            );
        }
    }

    #[test]
    fn a_batch_is_bounded_on_both_sides_and_the_error_names_the_limit() {
        let limits = Limits { points_per_request_max: 10, ..Limits::default() };
        assert!(limits.check_points(1).is_ok() && limits.check_points(10).is_ok());
        assert!(limits.check_points(0).unwrap_err().message.contains("points must not be empty"));
        let error = limits.check_points(11).unwrap_err();
        assert!(error.message.contains("11") && error.message.contains("points_per_request_max is 10"));
    }

    #[test]
    fn points_are_compared_with_as_many_sides_as_the_limit_says_and_no_more() {
        let limits = Limits { keep_out_tests_max: 1000, ..Limits::default() };
        assert!(limits.check_keep_out_tests(10, 100).is_ok() && limits.check_keep_out_tests(5000, 0).is_ok());
        for (points, sides) in [(11, 100), (usize::MAX, 2)] {
            let error = limits.check_keep_out_tests(points, sides).unwrap_err();
            assert!(error.message.contains("keep_out_tests_max, 1000"), "{error}");
        }
    }

    #[test]
    fn a_body_or_a_group_has_as_many_parts_as_the_limit_says_and_no_more() {
        let limits = Limits { body_parts_max: 5, ..Limits::default() };
        assert!(limits.check_body_parts(5).is_ok() && limits.check_group_sizes(&[5, 1, 5]).is_ok());
        let refused = limits.check_body_parts(6).unwrap_err().message;
        assert_eq!(refused, "body has 6 links, spheres and points, body_parts_max is 5");
        let refused = limits.check_group_sizes(&[5, 6]).unwrap_err().message;
        assert_eq!(refused, "sizes[1] has 6 spheres, body_parts_max is 5");
    }

    #[test]
    fn a_prism_has_as_many_corners_as_the_limit_says_and_no_more() {
        let limits = Limits { keep_out_corners_max: 5, ..Limits::default() };
        assert!(limits.check_corners(0).is_ok() && limits.check_corners(5).is_ok());
        let refused = limits.check_corners(6).unwrap_err().message;
        assert_eq!(refused, "prism.corners_m has 6 corners, keep_out_corners_max is 5");
    }

    #[test]
    fn a_block_has_room_in_one_message() {
        let of = |block_bytes_max, message_bytes_max| Limits {
            block_bytes_max,
            message_bytes_max,
            ..Limits::default()
        };
        assert_eq!(of(1000, 2024).block_bytes(), (1000, "block_bytes_max"));
        for (limits, most) in [(of(1001, 2024), 1000), (of(1000, 5), 0)] {
            assert!(limits.check_block_bytes(most).is_ok());
            let error = limits.check_block_bytes(most + 1).unwrap_err();
            assert!(error.message.contains(&format!("message_bytes_max, less 1 KiB, is {most}")), "{error}");
        }
    }

    #[test]
    fn what_lies_in_memory_for_a_while_is_an_eighth_of_what_there_is_at_most() {
        let limits = Limits::default();
        assert_eq!(limits.clone().within_memory(None), limits);
        assert_eq!(limits.clone().within_memory(Some(16 << 30)), limits);
        let small = limits.clone().within_memory(Some(512 << 20));
        assert_eq!((small.body_bytes_max, small.map_file_bytes_max), (64 << 20, 64 << 20));
        assert_eq!(small.localization_grid_bytes_max, 64 << 20);
        // One message must have room.
        assert_eq!(limits.clone().within_memory(Some(64 << 20)).body_bytes_max, limits.message_bytes_max);
    }
}
