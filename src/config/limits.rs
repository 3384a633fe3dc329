//! Checks of the section `limits`. The limits themselves are [`Limits`].

use super::error::ConfigError;
use mrol_map::map::{KEEP_OUTS_MAX, PRISM_CORNERS_MAX};
use mrol_service::{EVENTS_MAX, Limits};

/// Refuses limits that would keep the server from working at all.
pub(super) fn check(limits: &Limits) -> Result<(), ConfigError> {
    let range = |key, range, value: String| Err(ConfigError::Range { key, range, value });
    if limits.message_bytes_max == 0 {
        return range("limits.message_bytes_max", "at least 1", "0".into());
    }
    for (key, value, least, allowed) in [
        ("limits.requests_max", limits.requests_max, 1, "1 to 1048576"),
        ("limits.streams_max", limits.streams_max, 1, "1 to 1048576"),
        ("limits.trajectory_page_max", limits.trajectory_page_max, 1, "1 to 1048576"),
        ("limits.robots_per_map_max", limits.robots_per_map_max, 1, "1 to 1048576"),
        ("limits.robots_per_caller_max", limits.robots_per_caller_max, 0, "0 to 1048576"),
        ("limits.jobs_waiting_max", limits.jobs_waiting_max, 0, "0 to 1048576"),
        ("limits.probes_max", limits.probes_max, 1, "1 to 1048576"),
        ("limits.probe_body_bytes_max", limits.probe_body_bytes_max, 64, "64 to 1048576"),
        ("limits.scrapes_max", limits.scrapes_max, 1, "1 to 1048576"),
        ("limits.health_watches_max", limits.health_watches_max, 0, "0 to 1048576"),
        ("limits.watches_max", limits.watches_max, 0, "0 to 1048576"),
        ("limits.caller_watches_max", limits.caller_watches_max, 0, "0 to 1048576"),
        ("limits.caller_streams_max", limits.caller_streams_max, 0, "0 to 1048576"),
        ("limits.connections_reserved", limits.connections_reserved, 0, "0 to 1048576"),
    ] {
        if !(least..=1 << 20).contains(&value) {
            return range(key, allowed, value.to_string());
        }
    }
    if limits.events_per_map_max > EVENTS_MAX {
        return range("limits.events_per_map_max", "0 to 4096", limits.events_per_map_max.to_string());
    }
    if limits.keep_outs_max > KEEP_OUTS_MAX {
        return range("limits.keep_outs_max", "0 to 256", limits.keep_outs_max.to_string());
    }
    if !(3..=PRISM_CORNERS_MAX).contains(&limits.keep_out_corners_max) {
        return range("limits.keep_out_corners_max", "3 to 64", limits.keep_out_corners_max.to_string());
    }
    for (key, seconds) in [
        ("limits.point_times_max_s", limits.point_times_max_s),
        ("limits.min_revision_wait_max_s", limits.min_revision_wait_max_s),
        ("limits.question_time_max_s", limits.question_time_max_s),
        ("limits.long_question_time_max_s", limits.long_question_time_max_s),
        ("limits.grid_time_max_s", limits.grid_time_max_s),
        ("limits.alignment_time_max_s", limits.alignment_time_max_s),
        ("limits.insertion_time_max_s", limits.insertion_time_max_s),
        ("limits.undo_time_max_s", limits.undo_time_max_s),
        ("limits.localization_time_max_s", limits.localization_time_max_s),
        ("limits.recovery_search_time_max_s", limits.recovery_search_time_max_s),
        ("limits.recovery_search_interval_s", limits.recovery_search_interval_s),
        ("limits.observers_time_max_s", limits.observers_time_max_s),
        ("limits.connection_opening_max_s", limits.connection_opening_max_s),
        ("limits.http_idle_max_s", limits.http_idle_max_s),
        ("limits.grpc_idle_max_s", limits.grpc_idle_max_s),
        ("limits.body_silence_max_s", limits.body_silence_max_s),
        ("limits.probe_time_max_s", limits.probe_time_max_s),
        ("limits.scrape_kept_s", limits.scrape_kept_s),
        ("limits.health_watch_max_s", limits.health_watch_max_s),
        ("limits.watch_unread_max_s", limits.watch_unread_max_s),
    ] {
        if !(0.0..=86_400.0).contains(&seconds) {
            return range(key, "0 to 86400", seconds.to_string());
        }
    }
    if !(0.01..=86_400.0).contains(&limits.watch_heartbeat_s) {
        let value = limits.watch_heartbeat_s.to_string();
        return range("limits.watch_heartbeat_s", "0.01 to 86400", value);
    }
    if limits.body_bytes_max < limits.message_bytes_max {
        let least = "at least limits.message_bytes_max";
        return range("limits.body_bytes_max", least, limits.body_bytes_max.to_string());
    }
    // Each request may be on a connection of its own, in work or arriving, and each stream.
    if limits.connections_max <= 2 * limits.requests_max + limits.streams_max + limits.watches_max {
        let least = "more than twice limits.requests_max, limits.streams_max and limits.watches_max";
        return range("limits.connections_max", least, limits.connections_max.to_string());
    }
    check_marks(limits)
}

/// Refuses watermarks that are not in order or beyond any system.
fn check_marks(limits: &Limits) -> Result<(), ConfigError> {
    let range = |key, range, value: u64| Err(ConfigError::Range { key, range, value: value.to_string() });
    for (key, mib) in [
        ("limits.disk_free_low_mib", limits.disk_free_low_mib),
        ("limits.disk_free_resume_mib", limits.disk_free_resume_mib),
        ("limits.memory_high_mib", limits.memory_high_mib),
        ("limits.memory_resume_mib", limits.memory_resume_mib),
    ] {
        if mib > 1 << 40 {
            return range(key, "0 to 1099511627776", mib);
        }
    }
    if limits.disk_free_resume_mib <= limits.disk_free_low_mib {
        let more = "more than limits.disk_free_low_mib";
        return range("limits.disk_free_resume_mib", more, limits.disk_free_resume_mib);
    }
    match (limits.memory_high_mib, limits.memory_resume_mib) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keep_outs_lie_within_what_a_map_can_have() {
        for (keep_outs_max, keep_out_corners_max, is_fine) in
            [(0, 3, true), (256, 64, true), (257, 64, false), (256, 65, false), (256, 2, false)]
        {
            let limits = Limits { keep_outs_max, keep_out_corners_max, ..Limits::default() };
            assert_eq!(check(&limits).is_ok(), is_fine, "{keep_outs_max}, {keep_out_corners_max}");
        }
    }

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
                let checked = check(&limits);
                assert_eq!(checked.is_ok(), is_fine, "{name} {seconds}");
                assert!(checked.is_ok() || checked.unwrap_err().to_string().contains(name));
            }
        }
    }
}
