//! The limits as a table, and the marks of disk and memory that are made of them.

use mrol_map::map::{KEEP_OUTS_MAX, PRISM_CORNERS_MAX};
use mrol_map::mapping::VIEWPOINT_BYTES_MAX_DEFAULT;
use mrol_map::planning::FIELD_BYTES_MAX_DEFAULT;

use crate::section;

section! {
    /// The limits of the server: on what callers may ask, on what is done at once, and on what the machine has. Each is
    /// named in the error of a request beyond it.
    pub struct Limits in "limits" {
        /// Bytes of one HTTP body or one gRPC message.
        message_bytes_max: usize = Self::MESSAGE_BYTES_MAX; bytes, from 1;
        /// Points of a query, deletion or scan, or rays of one question.
        points_per_request_max: usize = 2_000_000; none;
        /// How far the time of a scan's point may lie from the scan's `timestamp_ns`.
        point_times_max_s: f64 = 2.0; s, from 0, to DAY_S;
        /// Keys of a deletion.
        keys_per_request_max: usize = 2_000_000; none;
        /// Voxels of one listing.
        listed_voxels_max: usize = 20_000_000; none;
        /// Bytes of a block that is given out: one a cell of a dense one, 72 for 8 x 8 x 8 voxels of a sparse one. Less
        /// where `message_bytes_max` is less than 1 KiB more.
        block_bytes_max: usize = 16 << 20; bytes;
        /// Cells of a dense block and of what lies around it within its cap.
        block_cells_max: usize = 64 << 20; none;
        /// Links, spheres and points, in all, of a body that is checked, and spheres of a group of `CheckSpheres`. A
        /// body has 65,536 links at most, whatever this is.
        body_parts_max: usize = 16_384; none;
        /// Distance fields that a map keeps for checks of bodies, 12 to 30 bytes a voxel near which checks were asked.
        /// Beyond, the oldest part goes and is computed anew where it is asked for: slower, and as exact.
        planning_field_bytes_max: usize = FIELD_BYTES_MAX_DEFAULT; bytes;
        /// Time of a planner's question, or of a part of one that is answered in parts, while changes of the map wait
        /// for it.
        question_time_max_s: f64 = 0.5; s, from 0, to DAY_S;
        /// Time of all parts of a question that is answered in parts: a classification of points, 262,144 at a time.
        /// Between them changes are made and callers take turns.
        long_question_time_max_s: f64 = 10.0; s, from 0, to DAY_S;
        /// Cells of one 2-D grid that is answered as a whole.
        grid_cells_max: usize = 4_000_000; none;
        /// Time of a 2-D grid that comes in tiles, the client's reading with it. Each tile has `question_time_max_s` of
        /// its own.
        grid_time_max_s: f64 = 60.0; s, from 0, to DAY_S;
        /// Voxels of a box in which frontiers are looked for.
        frontier_cells_max: usize = 4_000_000; none;
        /// Frontiers of one answer.
        frontiers_max: usize = 1000; none;
        /// Scans that one list of those that touched a voxel has at most, the newest.
        observers_max: usize = 100; none;
        /// Reading the journal for such a list. What is not read by then is said to be older.
        observers_time_max_s: f64 = 10.0; s, from 0, to DAY_S;
        /// Poses of one page of a trajectory, and of one that is asked for without a limit.
        trajectory_page_max: usize = 5_000; none, from 1, to MANY;
        /// Maps at once.
        maps_max: usize = 64; none;
        /// Finest voxels of a map.
        voxels_per_map_max: usize = 200_000_000; none;
        /// Memory of a map's viewpoints, by which it knows what is free. Where it is full, those that add least go.
        viewpoint_bytes_max: usize = VIEWPOINT_BYTES_MAX_DEFAULT; bytes;
        /// Robots with scans, or ids of scans, in a map. A name whose scans were all undone is free again.
        robots_per_map_max: usize = 4_096; none, from 1, to MANY;
        /// Robots with scans in a map that one key, or one address where there is no key, brought in since the server
        /// opened the map, so that nobody takes all names. 0 = any number.
        robots_per_caller_max: usize = 1_024; none, from 0, to MANY;
        /// A map file, taken or restored, before and after compression.
        map_file_bytes_max: usize = 1 << 30; bytes;
        /// Requests in work, and as many whose bodies arrive. Three quarters of them may wait for maps that are being
        /// opened, half of those for one map; of either, one caller may have half. A map whose files have been read for
        /// 5 s keeps nobody waiting: `catalog_busy`.
        requests_max: usize = 512; none, from 1, to MANY;
        /// Calls whose client streams messages.
        streams_max: usize = 256; none, from 1, to MANY;
        /// Watches of maps, over both protocols.
        watches_max: usize = 256; none, from 0, to MANY;
        /// Longest time between two messages of a watch, where nothing changes.
        watch_heartbeat_s: f64 = 10.0; s, from 0.01, to DAY_S;
        /// A watch ends whose client takes no message for so long.
        watch_unread_max_s: f64 = 30.0; s, from 0, to DAY_S;
        /// Events that a map keeps in memory: what became of the last scans, and of the last of each of as many robots.
        events_per_map_max: usize = 256; none, from 0, to 4096;
        /// Jobs of a lane that wait for a thread; and, counted apart, callers that wait for the turn of their robot or
        /// of an undo, of which one caller may be as many as places are left.
        jobs_waiting_max: usize = 256; none, from 0, to MANY;
        /// All bodies that have arrived, the last body of a robot that each stream of checks keeps, and answers,
        /// listings and map files on their way out. JSON, and heads of the form for programs, count six times. At least
        /// `message_bytes_max`.
        body_bytes_max: usize = 1 << 30; bytes;
        /// Silence in the middle of a body.
        body_silence_max_s: f64 = 30.0; s, from 0, to DAY_S;
        /// A slower body counts as silent. 0 = any byte will do.
        body_bytes_per_s_min: u32 = 1024; bytes_per_s;
        /// Requests and messages of streams a second of one key, or of one address where there is no key. 0 = any
        /// number.
        caller_requests_per_s_max: u32 = 0; none;
        /// As many may come at once.
        caller_burst_max: u32 = 100; none;
        /// Requests and streams in work at a time of one key that says nothing of that itself, so that no key keeps
        /// others out. 0 = any number.
        caller_requests_at_once_max: u32 = 192; none;
        /// Watches of one key, or of one address where there is no key, so that nobody has all `watches_max`. 0 = any
        /// number. Raise it where many come by one address, as through a proxy.
        caller_watches_max: usize = 64; none, from 0, to MANY;
        /// The same of streams, of `streams_max`.
        caller_streams_max: usize = 128; none, from 0, to MANY;
        /// Connections of HTTP, and as many of gRPC. Where all are in use another is closed at once; where one is idle,
        /// it gives way. More than twice `requests_max`, and `streams_max` and `watches_max` besides.
        connections_max: usize = 2048; none;
        /// Time until a connection is secure and begins to speak.
        connection_opening_max_s: f64 = 10.0; s, from 0, to DAY_S;
        /// An HTTP connection without a request, or one request's headers.
        http_idle_max_s: f64 = 30.0; s, from 0, to DAY_S;
        /// A gRPC connection without a call.
        grpc_idle_max_s: f64 = 600.0; s, from 0, to DAY_S;
        /// Time that the body of a health check may take.
        probe_time_max_s: f64 = 5.0; s, from 0, to DAY_S;
        /// A call of `grpc.health.v1.Health/Watch` without a key ends after so long.
        health_watch_max_s: f64 = 600.0; s, from 0, to DAY_S;
        /// Waiting for `min_revision`. The call's own deadline may end it sooner.
        min_revision_wait_max_s: f64 = 10.0; s, from 0, to DAY_S;
        /// Aligning a scan that is not inserted. This and the next two count from when a thread begins with the work.
        alignment_time_max_s: f64 = 10.0; s, from 0, to DAY_S;
        /// Aligning and preparing a scan that is inserted.
        insertion_time_max_s: f64 = 30.0; s, from 0, to DAY_S;
        /// Finding out what an undo takes back.
        undo_time_max_s: f64 = 60.0; s, from 0, to DAY_S;
        /// A search with no guess.
        localization_time_max_s: f64 = 60.0; s, from 0, to DAY_S;
        /// Candidates of a search, which keeps that many places.
        localization_candidates_max: usize = 16; none;
        /// Memory of a search. A map that needs more is searched at a coarser resolution, and refused
        /// (`search_too_large`) where the coarsest needs more too.
        localization_grid_bytes_max: usize = 512 << 20; bytes;
        /// A search for a lost robot.
        recovery_search_time_max_s: f64 = 2.0; s, from 0, to DAY_S;
        /// Free disk of the data folder below which changes are refused. 0 = never.
        disk_free_low_mib: u64 = 256; MiB, from 0, to MIB_MAX;
        /// Free disk from which on they are taken again.
        disk_free_resume_mib: u64 = 512; MiB, from 0, to MIB_MAX;
        /// Memory in use above which what makes maps grow is refused. 0 = 85 % of what the system or the control group
        /// allows.
        memory_high_mib: u64 = 0; MiB, from 0, to MIB_MAX;
        /// Memory in use at which it is taken again. 0 = 94 % of the high mark.
        memory_resume_mib: u64 = 0; MiB, from 0, to MIB_MAX;
    } constants {
        /// Connections of each protocol besides `connections_max`, where all of those are in use: for one health check
        /// each, and for `probe_time_max_s` at most. Where all of these are taken too, one that has its answer gives
        /// way, or one of the peer that has most.
        connections_reserved: usize = 128;
        /// Health checks that are arriving, and as many that are answered, over each protocol. Where all places are
        /// taken, the oldest gives way.
        probes_max: usize = 64;
        /// Bytes of the body of a health check, which comes as it is: nothing is inflated.
        probe_body_bytes_max: usize = 1 << 10;
        /// Scrapes of the metrics that wait or are being read.
        scrapes_max: usize = 16;
        /// Seconds for which the text of a scrape answers those that follow.
        scrape_kept_s: f64 = 1.0;
        /// Calls of `grpc.health.v1.Health/Watch`, one a connection.
        health_watches_max: usize = 16;
        /// Keep-outs of a map.
        keep_outs_max: usize = KEEP_OUTS_MAX;
        /// Corners of a keep-out that is a prism.
        keep_out_corners_max: usize = PRISM_CORNERS_MAX;
        /// Comparisons of points with the sides of keep-outs in one query: points times corners, a shape without
        /// corners counting as one. Some seconds.
        keep_out_tests_max: usize = 400_000_000;
        /// Regions in which a check ignores voxels. A message has 4,096 at most.
        ignored_regions_max: usize = 64;
        /// Scans of a map file that is restored, and as many that were taken out again.
        map_file_scans_max: usize = 20_000_000;
        /// Seconds from one search for a lost robot to the next for the same one, at least.
        recovery_search_interval_s: f64 = 2.0;
    }
}

/// The longest time, seconds.
const DAY_S: f64 = 86_400.0;
/// The largest number of things at once.
const MANY: u32 = 1 << 20;
/// The largest number of MiB: more than any system has.
const MIB_MAX: f64 = (1u64 << 40) as f64;

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
    fn times_lie_within_a_day() {
        type Set = fn(&mut Limits, f64);
        let times: [(&str, Set); 3] = [
            ("limits.alignment_time_max_s", |limits, seconds| limits.alignment_time_max_s = seconds),
            ("limits.insertion_time_max_s", |limits, seconds| limits.insertion_time_max_s = seconds),
            ("limits.undo_time_max_s", |limits, seconds| limits.undo_time_max_s = seconds),
        ];
        for (name, set) in times {
            for (seconds, is_fine) in
                [(0.0, true), (86_400.0, true), (86_400.1, false), (-0.1, false), (f64::NAN, false)]
            {
                let mut limits = Limits::default();
                set(&mut limits, seconds);
                let refused = limits.out_of_range().map(|refused| (refused.key, refused.range));
                let expected = (!is_fine).then(|| (name, "0 to 86400".to_owned()));
                assert_eq!(refused, expected, "{name} {seconds}");
            }
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
