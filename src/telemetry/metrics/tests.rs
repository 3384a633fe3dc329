//! What is counted, and what of it a scrape gets.

use super::recorder::*;
use crate::telemetry::NodeReading;
use mrol_map::align::Verdict;
use mrol_map::map::Lookup;
use mrol_map::map::{MapName, RobotName, SessionName};
use mrol_service::{Change, End, Ended, JudgedScan, Observer, Outcome};
use std::time::Duration;

/// A scan that was judged.
fn judged(robot: &str, verdict: Verdict) -> JudgedScan {
    let (robot, align_time) = (RobotName::new(robot).unwrap(), Duration::from_millis(30));
    let refusal = (verdict != Verdict::Accepted).then(|| "it does not fit".to_owned());
    JudgedScan {
        robot,
        session: SessionName::default(),
        scan_id: None,
        verdict,
        refusal,
        overlap: 0.25,
        align_time,
        replayed: false,
        recovered: None,
        carved: None,
    }
}

/// What is known of a service that has these maps, none of which is open.
fn of(names: &[MapName]) -> ServiceReading {
    ServiceReading { names: names.to_vec(), ..ServiceReading::default() }
}

/// Tells `metrics` that something was done to `map`.
fn tell(metrics: &Metrics, map: &MapName, outcome: Outcome) {
    let end = End::Done(outcome);
    metrics.operation_ended(&Ended { operation: "Any", caller: None, map: Some(map), end });
}

#[test]
fn what_was_counted_is_rendered_with_its_description() {
    let metrics = Metrics::new().unwrap();
    let map = MapName::new("a").unwrap();
    metrics.request("grpc", "QueryPoints", "ok", Duration::from_millis(3));
    tell(&metrics, &map, Outcome::Points { lookup: Lookup::Bloom, points: 7 });
    tell(&metrics, &map, Outcome::Points { lookup: Lookup::Bloom, points: 5 });
    metrics.scan(&map, &judged("r", Verdict::LowOverlap));
    let text = metrics.render(&of(&[map]));
    for line in [
        r#"mrol_requests_total{protocol="grpc",operation="QueryPoints",code="ok"} 1"#,
        r#"mrol_request_seconds_bucket{protocol="grpc",operation="QueryPoints",le="0.005"} 1"#,
        r#"mrol_points_queried_total{map="a",lookup="bloom"} 12"#,
        r#"mrol_scans_total{map="a",verdict="low_overlap"} 1"#,
        r#"mrol_robot_scans_total{robot="r",verdict="low_overlap"} 1"#,
        r#"mrol_scan_overlap_bucket{verdict="low_overlap",le="0.2"} 0"#,
        r#"mrol_scan_overlap_bucket{verdict="low_overlap",le="0.3"} 1"#,
        r#"mrol_scan_align_seconds_bucket{verdict="low_overlap",le="0.05"} 1"#,
        r#"le="60"} 1"#,
        concat!(r#"mrol_build_info{version=""#, env!("CARGO_PKG_VERSION"), "\""),
        "# TYPE mrol_request_seconds histogram",
        "# HELP mrol_scans_total Scans judged",
    ] {
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
}

#[test]
fn a_map_that_is_gone_leaves_no_series() {
    let metrics = Metrics::new().unwrap();
    let [kept, gone] = ["kept", "gone"].map(|name| MapName::new(name).unwrap());
    for map in [&kept, &gone] {
        tell(&metrics, map, Outcome::Points { lookup: Lookup::Exact, points: 1 });
        metrics.scan(map, &judged("r", Verdict::Accepted));
        let undone = Change { voxels_removed: 1, scans_undone: 1, ..Change::default() };
        tell(&metrics, map, Outcome::Changed(undone));
    }
    let names = std::slice::from_ref(&kept);
    let text = metrics.render(&of(names));
    assert!(text.contains(r#"map="kept""#) && !text.contains("gone"), "{text}");
    metrics.keep_maps(names);
    assert!(!metrics.render(&of(&[kept, gone])).contains("gone"));
}

#[test]
fn keys_have_so_many_series_and_no_more() {
    let metrics = Metrics::new().unwrap();
    for key in 0..KEY_SERIES_MAX + 2 {
        metrics.key_used("http", &format!("key-{key}"));
    }
    metrics.key_used("http", "key-0");
    let text = metrics.render(&ServiceReading::default());
    assert_eq!(text.matches("mrol_key_requests_total{").count(), KEY_SERIES_MAX + 1);
    assert!(text.contains(r#"key="(others)"} 2"#) && text.contains(r#"key="key-0"} 2"#));
}

#[test]
fn robots_beyond_the_bound_are_counted_together() {
    let (metrics, map) = (Metrics::new().unwrap(), MapName::new("a").unwrap());
    let scan = |robot: usize| {
        metrics.scan(&map, &judged(&format!("r{robot}"), Verdict::Accepted));
    };
    (0..Metrics::ROBOTS_MAX + 2).for_each(scan);
    scan(0);
    let text = metrics.render(&ServiceReading::default());
    assert_eq!(text.matches("mrol_robot_scans_total{").count(), Metrics::ROBOTS_MAX + 1);
    for line in [
        r#"{robot="r0",verdict="accepted"} 2"#,
        r#"{robot="r99",verdict="accepted"} 1"#,
        r#"{robot="other",verdict="accepted"} 2"#,
    ] {
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
}

#[test]
fn a_connection_is_open_until_it_is_dropped() {
    let metrics = Metrics::new().unwrap();
    let open = metrics.connection_opened("http");
    metrics.connection_refused("http");
    assert!(
        metrics.render(&ServiceReading::default()).contains(r#"mrol_connections_open{listener="http"} 1"#)
    );
    drop(open);
    let text = metrics.render(&ServiceReading::default());
    for line in ["open", "accepted_total", "refused_total"]
        .map(|name| format!("mrol_connections_{name}{{listener=\"http\"}}"))
    {
        let value = if line.contains("open") { "0" } else { "1" };
        assert!(text.contains(&format!("{line} {value}")), "{line} {value} is not in\n{text}");
    }
}

#[test]
fn two_servers_count_apart() {
    let (one, other) = (Metrics::new().unwrap(), Metrics::new().unwrap());
    one.request("http", "GetMap", "200", Duration::ZERO);
    assert!(!other.render(&ServiceReading::default()).contains("GetMap"));
}

#[test]
fn a_server_by_itself_says_nothing_of_a_cluster() {
    let metrics = Metrics::new().unwrap();
    assert!(!metrics.render(&ServiceReading::default()).contains("mrol_node_"));
    metrics.node(NodeReading { live: 3, ..NodeReading::default() });
    let text = metrics.render(&ServiceReading::default());
    assert!(
        text.contains("mrol_node_joined 0") && text.contains(r#"mrol_cluster_nodes{state="live"} 3"#),
        "{text}"
    );
}
