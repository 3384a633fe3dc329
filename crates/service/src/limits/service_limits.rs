//! The limits, with their defaults, and the marks of disk and memory that are made of them.

use serde::{Deserialize, Serialize};

use mrol_map::map::{KEEP_OUTS_MAX, PRISM_CORNERS_MAX};
use mrol_map::mapping::VIEWPOINT_BYTES_MAX_DEFAULT;
use mrol_map::planning::FIELD_BYTES_MAX_DEFAULT;

/// The limits of the server: on what callers may ask, on what is done at once, and on what the machine has. Each is
/// named in the error of a request beyond it, and is a setting of the section `limits`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Bytes of one HTTP body or one gRPC message. 32 MiB.
    pub message_bytes_max: usize,
    /// Connections of HTTP, and as many of gRPC. Where all are in use another is closed at once; where one is idle, it
    /// gives way. More than twice `requests_max` and `streams_max`, so that there is always one. 2048.
    pub connections_max: usize,
    /// Connections of each protocol besides, where all of those are in use: for one health check each, and for
    /// `probe_time_max_s` at most. Where all of these are taken too, one that has its answer gives way, or one of the
    /// peer that has most. 128.
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
    /// Bytes of bodies that have arrived, of what streams keep of them, and of answers, listings and files that are
    /// being sent. 1 GiB.
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
    /// Requests and streams in work at a time of one key that says nothing of that itself; 0 = any number. Less than
    /// half of `requests_max`, so that no key keeps the others out. 192.
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
    /// Watches of one caller at once: of a key, or of an address where there is none; 0 = any number. A quarter of
    /// `watches_max`, so that nobody has them all. 64.
    pub caller_watches_max: usize,
    /// Streams of one caller at once, as `caller_watches_max`. Half of `streams_max`. 128.
    pub caller_streams_max: usize,
    /// Longest time between two messages of a watch, where nothing changes. 10 s.
    pub watch_heartbeat_s: f64,
    /// How long a watch's client may take no message, until the watch ends. 30 s.
    pub watch_unread_max_s: f64,
    /// Events that a map keeps in memory: what became of the last scans, and of the last of each of as many robots.
    /// 256.
    pub events_per_map_max: usize,
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
    /// Links, spheres and points, in all, of a body that is checked, and spheres of a group that is checked as one. A
    /// body has 65,536 links at most, whatever this is. 16,384.
    pub body_parts_max: usize,
    /// Regions in which a check ignores voxels. A message has 4,096 at most, whatever this is. 64.
    pub ignored_regions_max: usize,
    /// Bytes of the distance fields that a map keeps for checks of bodies. Less is slower and as exact: the oldest part
    /// goes. 128 MiB.
    pub planning_field_bytes_max: usize,
    /// How long a question of a planner may take, while changes of the map wait for it. 0.5 s.
    pub question_time_max_s: f64,
    /// Time of a question that is answered in parts, seconds: each part takes `question_time_max_s` at most.
    pub long_question_time_max_s: f64,
    /// How long a grid that is drawn in tiles may take in all, its client's reading with it. 60 s.
    pub grid_time_max_s: f64,
    /// Cells of one 2-D grid that is answered as a whole. 4,000,000.
    pub grid_cells_max: usize,
    /// Voxels of a box in which frontiers are looked for. 4,000,000.
    pub frontier_cells_max: usize,
    /// Frontiers of one answer. 1,000.
    pub frontiers_max: usize,
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
    /// Comparisons of points with the sides of keep-outs in one query: points times corners, a shape without corners
    /// counting as one. 400,000,000, some seconds.
    pub keep_out_tests_max: usize,
    /// Corners of a keep-out that is a prism. 64, which is also the most.
    pub keep_out_corners_max: usize,
    /// Bytes of memory of a map's viewpoints, by which it knows what is free. Where it is full, those that add least
    /// go. 64 MiB.
    pub viewpoint_bytes_max: usize,
    /// Robots of which one map keeps scans, or ids of scans. 4,096.
    pub robots_per_map_max: usize,
    /// Robots with scans in a map that one caller brought in since the map was opened: the holder of a key, or an
    /// address where there is none; 0 = any number. A quarter of `robots_per_map_max`. 1,024.
    pub robots_per_caller_max: usize,
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
    /// MiB of memory in use above which what makes maps grow is refused; 0 = 85 % of what the system or the control
    /// group allows. 0.
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
            caller_watches_max: 64,
            caller_streams_max: 128,
            watch_heartbeat_s: 10.0,
            watch_unread_max_s: 30.0,
            events_per_map_max: 256,
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
            long_question_time_max_s: 10.0,
            grid_time_max_s: 60.0,
            grid_cells_max: 4_000_000,
            frontier_cells_max: 4_000_000,
            frontiers_max: 1000,
            block_bytes_max: 16 << 20,
            block_cells_max: 64 << 20,
            observers_max: 100,
            observers_time_max_s: 10.0,
            trajectory_page_max: 5_000,
            keep_outs_max: KEEP_OUTS_MAX,
            keep_out_tests_max: 400_000_000,
            keep_out_corners_max: PRISM_CORNERS_MAX,
            viewpoint_bytes_max: VIEWPOINT_BYTES_MAX_DEFAULT,
            robots_per_map_max: 4_096,
            robots_per_caller_max: 1_024,
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
    pub fn marks(&self) -> Marks {
        let given = |mib: u64| (mib > 0).then_some(mib << 20);
        Marks {
            disk_free_low_bytes: self.disk_free_low_mib << 20,
            disk_free_resume_bytes: self.disk_free_resume_mib << 20,
            memory_high_bytes: given(self.memory_high_mib),
            memory_resume_bytes: given(self.memory_resume_mib),
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

#[cfg(test)]
mod tests {
    use super::*;

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
