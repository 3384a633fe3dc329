//! Every reason of a failure, once: its word for programs, its code, its meaning, and what to do.
//!
//! The list of reasons in `docs/guide/api.md` is made from this table; a test says so.

use super::code::ErrorCode;

/// Where a reason is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportedBy {
    /// By both protocols.
    Both,
    /// By HTTP alone.
    Http,
    /// By gRPC alone.
    Grpc,
    /// By the Rust client, of an answer that it cannot read.
    Client,
}

struct Row {
    word: &'static str,
    code: ErrorCode,
    reported_by: ReportedBy,
    http_status: Option<u16>,
    meaning: &'static str,
    remedy: &'static str,
}

/// Makes [`Reason`] and its rows from one table: by code, a name, its word, who tells it, an HTTP status where the one
/// of the code is not precise, the meaning, and what to do.
macro_rules! reasons {
    ($($code:ident {
        $($name:ident $word:literal $reported_by:ident $($status:literal)?: $meaning:literal, $remedy:literal;)+
    })+) => {
        /// Why a request failed: a stable word for programs.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Reason {
            $($(
                #[doc = concat!("`", $word, "`: ", $meaning, ".")]
                $name,
            )+)+
        }

        impl Reason {
            /// All reasons, by code and then by name.
            pub const ALL: &[Self] = &[$($(Self::$name),+),+];

            /// The reason with this word.
            pub fn of_word(word: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|reason| reason.as_str() == word)
            }

            fn row(self) -> Row {
                match self {
                    $($(Self::$name => Row {
                        word: $word,
                        code: ErrorCode::$code,
                        reported_by: ReportedBy::$reported_by,
                        http_status: [$($status)?].first().copied(),
                        meaning: $meaning,
                        remedy: $remedy,
                    },)+)+
                }
            }
        }
    };
}

reasons! {
    InvalidArgument {
        AllPointsFiltered "all_points_filtered" Both: "no point of the scan passes the robot's range limits and body box", "check them; is the unit meters?";
        AmbiguousGuess "ambiguous_guess" Http: "several of `guess`, `motion` and `constant_velocity` are given", "give one";
        AmbiguousPoints "ambiguous_points" Grpc: "both `xyz_f32le` and `xyz` are filled", "fill one";
        AmbiguousTarget "ambiguous_target" Http: "not exactly one target of a deletion or undo, shape of a keep-out, or voxel of a list of observers", "give one";
        BadArray "bad_array" Both: "an array of bytes is not as long as what it is an array of", "send as many bytes as the message says";
        BadBlocks "bad_blocks" Client: "the server's answer has blocks of voxels that are none", "update the client";
        BadCap "bad_cap" Both: "`cap_m` of a dense block is not more than 0", "send meters";
        BadCheck "bad_check" Both: "a body, configuration, sphere, motion, step or clearance is none, or out of range", "the message names which";
        BadCovariance "bad_covariance" Both: "the guess's covariance is not 36 finite numbers of a symmetric, positive semidefinite matrix", "send it row by row: x y z in meters, then turns about the map's axes in radians";
        BadDirection "bad_direction" Client: "the server's answer has a direction that is none", "update the client";
        BadFilter "bad_filter" Both: "range limits or body box are not numbers in order", "correct them";
        BadSensor "bad_sensor" Both: "a scan's `sensor` is no sensor model, or a number of it is out of range", "the message names which; or leave it out";
        BadGrid "bad_grid" Both: "a grid's rectangle or band is in the wrong order or not finite, or a cell is no whole number of voxels", "correct it";
        BadGuess "bad_guess" Grpc: "`constant_velocity` is false", "leave the guess out";
        BadGravity "bad_gravity" Both: "a scan's `gravity_in_sensor` is zero or not finite", "send the direction in which things fall, in the sensor frame; an accelerometer at rest reads the opposite";
        BadRevision "bad_revision" Both: "`not_seen_since` is a revision that the map has not reached, or comes without a region", "send a revision that an answer of this map had";
        BadExpiry "bad_expiry" Both: "the `expires_at_ns` of a keep-out lies in the past", "send nanoseconds since 1970, in the future";
        BadInformation "bad_information" Client: "the server's answer has an information matrix that is none", "update the client";
        BadJson "bad_json" Http: "the body is no JSON of this request: place, what is there, what belongs there", "correct it; unknown fields are errors";
        BadKeepOut "bad_keep_out" Both: "a prism with too few corners or more than `keep_out_corners_max`, a corner twice or not finite, no area, sides that cross, or heights out of order; a box without an end", "correct it";
        BadKey "bad_key" Both: "a voxel key or index out of range", "correct it";
        BadFrontiers "bad_frontiers" Both: "a box whose corners are in the wrong order or not finite, or a `standoff_m` that is not above 0 or more than 256 voxels of the level", "the message names the range";
        BadLookup "bad_lookup" Grpc: "a number that is none of the enum's", "use the generated constants";
        BadMapFile "bad_map_file" Both: "the file is no map file, or is damaged", "take another backup; `mrol map` and `mrol snapshot` write such files";
        BadMessage "bad_message" Grpc: "the message cannot be read", "check encoding and compression";
        BadPointTimes "bad_point_times" Both: "`point_times` are not one for each point, without `timestamp_ns`, or of points that count not finite or beyond `point_times_max_s`", "send seconds from `timestamp_ns`, one for each point";
        BadMethod "bad_method" Grpc: "a number that is none of the enum's", "use the generated constants";
        BadName "bad_name" Both: "the name of a map, keep-out, robot or request is not valid", "see [names](#rules-for-all-requests)";
        BadNumbers "bad_numbers" Http: "a parameter is not so many numbers with commas", "correct it";
        BadPose "bad_pose" Both: "not finite, or the quaternion is no unit quaternion", "normalize it";
        BadQuery "bad_query" Both: "unknown or malformed parameter; in a localization, a gravity or box that is none", "correct it";
        BadRadius "bad_radius" Both: "a search's radius is not above 0, or more than 64 voxels of the level", "take a coarser level for a larger radius";
        BadRay "bad_ray" Both: "a ray's origin is not in the map's range, its direction no unit vector, its end where it begins, or its range not above 0", "the message names which ray";
        BadRegion "bad_region" Both: "corners in the wrong order, a negative radius, not finite, or too far", "correct it";
        BadSettings "bad_settings" Both: "resolution, levels or filter of a map out of range", "the message names the range";
        BadTimeLimit "bad_time_limit" Both: "`time_limit_s` is negative or no number", "correct it";
        BadUuid "bad_uuid" Both: "`map_uuid` is no uuid", "send what an answer named";
        BadVerdict "bad_verdict" Client: "the server's answer has a verdict that this client does not know", "update the client";
        BadView "bad_view" Both: "angles not between 0 and pi, `far_m` not beyond `near_m`, or a camera that is too far", "correct it";
        BatchTooLarge "batch_too_large" Both: "more than `points_per_request_max`, `keys_per_request_max` or another limit on a request, which the message names", "split it, or use a stream";
        BodyTooLarge "body_too_large" Http 413: "the body exceeds `message_bytes_max`, of a map file `map_file_bytes_max`", "split it, or raise the limit";
        BodyUnreadable "body_unreadable" Http: "the body broke off", "send it again";
        EmptyBatch "empty_batch" Both: "there is no point, or no key", "leave the request out";
        HalfABox "half_a_box" Http: "only one of `min` and `max`, or of `map_from_box` and `size`, is given, or all of them", "give both of one pair";
        KeyOutOfRange "key_out_of_range" Both: "a voxel key outside the range of its level", "correct it";
        LevelOutOfRange "level_out_of_range" Both: "the map has no such level", "the message names the levels";
        MethodNotAllowed "method_not_allowed" Http 405: "the route has other methods; `Allow` names them", "correct it";
        MissingField "missing_field" Both: "a required field is not there", "give it";
        NoReturns "no_returns" Both: "no point of the scan is a return: all are not finite or at 0 0 0", "check the driver; `keep_zeros` keeps points at 0 0 0";
        NothingThere "nothing_there" Both: "the search box lies away from the map", "correct it";
        PageTooLarge "page_too_large" Both: "`limit` is not 1 to `trajectory_page_max`", "ask for pages by `since_revision`";
        PointNotFinite "point_not_finite" Both: "NaN or infinity in a query, or in a `strict` scan", "remove the point";
        PointOutOfRange "point_out_of_range" Both: "a point, a body, the end of a ray or a box outside the map's range: of what is there no voxel can tell", "remove it; is the unit meters?";
        ProbeBody "probe_body" Both: "the body of a health check exceeds `probe_body_bytes_max`", "send none";
        ScanOutOfRange "scan_out_of_range" Both: "no point of the scan lies within the map's range", "correct the pose";
        TimeLimitTooLong "time_limit_too_long" Both: "`time_limit_s` exceeds `localization_time_max_s`", "ask for less";
        TooManyCandidates "too_many_candidates" Both: "`candidates` exceeds `localization_candidates_max`", "ask for fewer";
        TruncatedPoints "truncated_points" Both: "the bytes are no whole points", "send 12 bytes a point";
        UnexpectedField "unexpected_field" Both: "a field that the operation does not take", "leave it out";
        UnexpectedQuery "unexpected_query" Http: "parameters beside a JSON body", "put them into the body";
        UnsupportedContentEncoding "unsupported_content_encoding" Http 415: "a compressed body", "send it as it is";
        UnsupportedContentType "unsupported_content_type" Http 415: "neither JSON nor bytes, where they are taken", "set `content-type`";
    }
    Unauthenticated {
        KeyExpired "key_expired" Both: "its time is up", "ask for a new one";
        KeyMissing "key_missing" Both: "no key was sent", "send `authorization: Bearer <secret>`";
        KeyUnknown "key_unknown" Both: "the key is not known here", "ask for one; was it revoked or rotated?";
        KeyWithdrawn "key_withdrawn" Both: "it was revoked or changed while the call was under way", "ask for a new one";
    }
    PermissionDenied {
        CrossSite "cross_site" Both: "a page of another site tried to change something", "nothing: it is not meant to work";
        HostNotAllowed "host_not_allowed" Both 421: "without keys the server answers to names that it knows alone", "set `access.hosts`, or connect by address";
        MapNotAllowed "map_not_allowed" Both: "the key is not for this map, whether or not there is one", "use another key";
        RobotNotAllowed "robot_not_allowed" Both: "the key is not for this robot; a revision may be another's", "name the robot and its scan";
        ScopeTooSmall "scope_too_small" Both: "the operation takes a larger scope; undo of a revision takes `write`", "use another key";
    }
    NotFound {
        KeepOutNotFound "keep_out_not_found" Both: "the map has no keep-out of this name, or it has ended", "list them";
        MapNotFound "map_not_found" Both: "no such map, or it was deleted or renamed meanwhile", "make it; `GET /v1/maps` lists them";
        RobotNotFound "robot_not_found" Both: "the map knows no robot of the name whose scans are to be undone", "correct the name; the message has those that it knows";
        RouteNotFound "route_not_found" Http: "no such path", "see [operations](#operations-over-http)";
        ScanNotFound "scan_not_found" Both: "no such accepted scan, or it was undone already; no such revision", "read the trajectory";
    }
    Conflict {
        MapExists "map_exists" Both: "a map of this name with other settings, or where one is to be restored or renamed", "another name, or `replace`";
        RequestIdTaken "request_id_taken" Both: "another request of this key had this id", "choose ids that are unique";
        ScanIdTaken "scan_id_taken" Both: "an accepted scan with other content has this id", "number new scans anew, in a new `session` after a restart";
    }
    FailedPrecondition {
        GuessRequired "guess_required" Both: "the robot has no accepted scan here, the map is not empty, and there is no guess", "give `guess`, or use `localize` first";
        MapEmpty "map_empty" Both: "the map has nothing to localize in", "insert a scan first";
        MapReplaced "map_replaced" Both: "the map is another one by now", "read its `map_uuid` and start again";
        MapShared "map_shared" Both: "several nodes share the map: it is not renamed or replaced on one of them", "make another map, or restore it under another name";
        NoFloor "no_floor" Both: "a grid's band counts from the floor, and the map has no poses of sensors or no floor below them", "give `band_from` `map`, and heights from z = 0 of the map";
        NoJournal "no_journal" Both: "the server keeps maps in memory only; undo and the list of observers need a journal", "start it with `--data-dir`";
        NotUndoable "not_undoable" Both: "the revision was made by an undo or a keep-out, or what it made was undone already", "send what was undone again, or delete it again; put or delete the keep-out again";
        OutsideUndoWindow "outside_undo_window" Both: "the scan or deletion is from before `storage.undo_from_revision`", "delete by region; `store.undo_revisions`, `store.undo_bytes_max`";
        RevisionsUsedUp "revisions_used_up" Both: "revision 2^53 was reached", "make another map";
        ScanIdTooOld "scan_id_too_old" Both: "the id is from before the undo window, where ids are not kept, or its session from long ago", "number new scans upwards, or choose another session";
        ScanWithdrawn "scan_withdrawn" Both: "the scan was accepted and undone since", "send it under a new id to have it back";
    }
    ResourceExhausted {
        BlockTooLarge "block_too_large" Both: "a block exceeds `block_bytes_max`, or with what lies around it `block_cells_max`", "ask for a smaller part, a coarser level or a smaller `cap_m`";
        DiskFull "disk_full" Both 507: "little room on the disk of the data folder; changes are refused until there is more", "make room, or delete a map";
        FrontierBoxTooLarge "frontier_box_too_large" Both: "a box of more than `frontier_cells_max` voxels", "ask for a smaller box or a coarser level";
        GridTooLarge "grid_too_large" Both: "a grid of more than `grid_cells_max` cells, or of more than a message holds; in tiles, of more than 268,435,456", "ask for it in tiles, for a smaller area or larger cells";
        ListingTooLarge "listing_too_large" Both: "more voxels than `listed_voxels_max`, with those that keep-outs take where they are asked for", "ask for a region or a coarser level";
        MapFileTooLarge "map_file_too_large" Both: "a map's file, or one that is to be restored, exceeds `map_file_bytes_max`", "raise the limit, here and where the file is to be restored";
        MapFull "map_full" Both: "the map would exceed `voxels_per_map_max`; a restored file also `robots_per_map_max`, `viewpoint_bytes_max` or `map_file_scans_max`, which is a constant", "make the map coarser, or raise the limit where it is a setting";
        MemoryFull "memory_full" Both 503: "little memory; what makes maps grow is refused", "delete a map, or give more memory";
        MessageTooLarge "message_too_large" Grpc: "a message exceeds `message_bytes_max`", "split it";
        Overloaded "overloaded" Both: "a limit on what is done at once, or on a caller's rate, is reached; the message names it", "wait as told, and retry";
        RecordTooLarge "record_too_large" Both: "one change of more than 2 GiB", "delete in parts";
        SearchTooLarge "search_too_large" Both: "the map exceeds `localization_grid_bytes_max`", "give a `search_box`";
        TooManyKeepOuts "too_many_keep_outs" Both: "the map has `keep_outs_max` keep-outs", "delete one";
        TooManyMaps "too_many_maps" Both: "the server has `maps_max` maps", "delete one, or raise the limit";
        TooManyRobots "too_many_robots" Both: "the map has scans of `robots_per_map_max` robots, or of `robots_per_caller_max` that the caller brought in", "use their names, undo all scans of one, or raise the limit";
    }
    DeadlineExceeded {
        BodyStalled "body_stalled" Both 408: "the body came too slowly (`body_silence_max_s`, `body_bytes_per_s_min`)", "send it faster";
        CallerGone "caller_gone" Both: "the caller went away first; nobody reads this", "nothing";
        Deadline "deadline" Grpc: "the call's own deadline passed", "set a longer one";
        HealthWatchOver "health_watch_over" Grpc: "a watch without a key lasts `health_watch_max_s`", "watch again";
        ProbeLate "probe_late" Both: "a health check did not come within `probe_time_max_s`", "send it faster";
        RevisionNotReached "revision_not_reached" Both: "`min_revision` did not come in time", "wait longer";
        WatchStalled "watch_stalled" Both: "a watch's client took no message for `watch_unread_max_s`", "read on, or watch again from the last revision";
        TimeLimit "time_limit" Both: "the scan or undo took longer than `alignment_time_max_s`, `insertion_time_max_s` or `undo_time_max_s`", "send a smaller scan, or raise the limit; where it waited for others, which the message says, send it again later";
    }
    Unavailable {
        CatalogBusy "catalog_busy" Both: "a map has been made, replaced, renamed, deleted or opened for long: it is large, or its disk slow", "retry as told";
        Draining "draining" Both: "the server is going down", "retry elsewhere or later";
        HistoriesDiffer "histories_differ" Both: "several nodes share the map, and this one has another history of it, cannot tell whether it has, or is behind where the log begins; the message names the revision", "ask another node; decide which history stays";
        MapElsewhere "map_elsewhere" Both 307: "other nodes of the cluster hold the map; the answer names their addresses", "ask one of them: HTTP clients follow `Location`, and send their key again";
        MapReadOnly "map_read_only" Both: "the map's journal failed; it answers queries and takes no changes", "mend the disk, restart the server";
        MapUnavailable "map_unavailable" Both: "the map could not be opened; the message names file and remedy", "`mrol doctor`, then restart";
        NoQuorum "no_quorum" Both: "several nodes share the map, and their log acknowledges nothing; nothing was changed", "retry as told";
        NotLeader "not_leader" Both: "several nodes share the map, and another one, or none yet, makes its changes", "retry as told, there or here";
        OutcomeUnknown "outcome_unknown" Both: "the journal failed while this change was written, or the log of several nodes did not acknowledge it: it may be there after the restart, now or later", "send the same `scan_id` or `request_id` again then";
        ReplicaStale "replica_stale" Client: "the replica heard its server longer ago than `age_max` allows", "ask the server, or wait until the replica is connected";
        Starting "starting" Http: "maps are being looked for", "wait; `/readyz` tells how far it is";
    }
    Internal {
        JobPanicked "job_panicked" Both: "a defect: a job of the server panicked", "report it, with the log";
        JournalUnreadable "journal_unreadable" Both: "a file of the journal cannot be read; the message names it", "mend the disk; `mrol doctor`";
        NoRule "no_rule" Both: "a defect: a route is served without a rule who may ask for it", "report it, with the log";
        NoThreads "no_threads" Both: "the system gives the server no more threads", "raise the limit of threads";
        NotAdmitted "not_admitted" Both: "a defect: a request passed the limits by", "report it, with the log";
        NotAuthorized "not_authorized" Both: "a defect: a request passed the keys by", "report it, with the log";
        NotEncoded "not_encoded" Both: "a defect: an answer or a file cannot be encoded", "report it, with the log";
        NotStored "not_stored" Both: "a file cannot be written; the message names it", "mend the disk, or make room";
        NotWritten "not_written" Both: "a defect: an answer cannot be written", "report it, with the log";
        ParserFailed "parser_failed" Both: "a defect: the parser of a message failed", "report it, with the log";
    }
}

impl Reason {
    /// The word for programs: `map_not_found`.
    pub fn as_str(self) -> &'static str {
        self.row().word
    }

    /// The kind of failure.
    pub fn code(self) -> ErrorCode {
        self.row().code
    }

    /// The HTTP status, where the code's is not precise.
    pub fn http_status(self) -> Option<u16> {
        self.row().http_status
    }

    /// Where it is told.
    pub fn reported_by(self) -> ReportedBy {
        self.row().reported_by
    }

    /// What has happened, in a few words of Markdown.
    pub fn meaning(self) -> &'static str {
        self.row().meaning
    }

    /// What to do about it, in a few words of Markdown.
    pub fn remedy(self) -> &'static str {
        self.row().remedy
    }
}

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::fmt::Write;

    const GUIDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/guide/api.md");
    const BEGIN: &str = "<!-- reasons: made from crates/service/src/error/reason.rs -->\n";
    const END: &str = "<!-- end of reasons -->";

    /// The tables of the guide, one for each code.
    fn tables() -> String {
        let mut text = String::new();
        let mut code = None;
        for reason in Reason::ALL {
            if code.replace(reason.code()) != Some(reason.code()) {
                let head = "| reason | meaning | what to do |\n|---|---|---|";
                write!(text, "\n**`{}`**\n\n{head}\n", reason.code().as_str()).unwrap();
            }
            let marks: Vec<String> = [
                match reason.reported_by() {
                    ReportedBy::Both => None,
                    ReportedBy::Http => Some("H".to_owned()),
                    ReportedBy::Grpc => Some("G".to_owned()),
                    ReportedBy::Client => Some("C".to_owned()),
                },
                reason.http_status().map(|status| format!("HTTP {status}")),
            ]
            .into_iter()
            .flatten()
            .collect();
            let marks = if marks.is_empty() { String::new() } else { format!(" ({})", marks.join(", ")) };
            writeln!(text, "| `{reason}`{marks} | {} | {} |", reason.meaning(), reason.remedy()).unwrap();
        }
        text
    }

    #[test]
    fn the_guide_lists_every_reason() {
        let guide = std::fs::read_to_string(GUIDE).unwrap();
        let begin = guide.find(BEGIN).expect("a place for the list") + BEGIN.len();
        let end = begin + guide[begin..].find(END).expect("the end of the list");
        let made = format!("{}\n", tables());
        if std::env::var_os("MROL_WRITE_DOCS").is_some() {
            std::fs::write(GUIDE, [&guide[..begin], &made, &guide[end..]].concat()).unwrap();
            return;
        }
        assert!(guide[begin..end] == made, "docs/guide/api.md is old: run this test with MROL_WRITE_DOCS=1");
    }

    #[test]
    fn words_are_unique_and_named_like_their_reasons() {
        let words: BTreeSet<&str> = Reason::ALL.iter().map(|reason| reason.as_str()).collect();
        assert_eq!(words.len(), Reason::ALL.len());
        for reason in Reason::ALL {
            assert_eq!(reason.as_str().replace('_', ""), format!("{reason:?}").to_lowercase());
        }
    }
}
