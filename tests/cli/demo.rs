//! `mrol demo`: the whole story, made short.

use super::objects;

#[test]
fn the_demonstration_succeeds_and_tells_what_it_measured() {
    let lines = objects(&[
        "demo",
        "--once",
        "--scans",
        "4",
        "--http-listen",
        "127.0.0.1:0",
        "--grpc-listen",
        "127.0.0.1:0",
    ]);
    assert!(lines[0]["grpc"].is_string(), "{}", lines[0]);
    assert_eq!(lines.len(), 2 + 2 * 4);
    for line in &lines[1..9] {
        assert_eq!(line["verdict"], "accepted");
        assert!(line["error_m"].as_f64().unwrap() < 0.1, "{line}");
    }
    let summary = &lines[9]["summary"];
    // A cart's scan of another place was refused, or this would be a problem.
    assert_eq!(summary["problems"], serde_json::json!([]));
    assert!(summary["planner"]["points"].as_u64().unwrap() > 0);
    assert_eq!(summary["robots"]["camera"]["accepted"], 4);
}

#[test]
fn a_robot_explores_the_building_by_itself_and_meets_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("explored.svg");
    // The command fails where less than 95 % of what can be seen is mapped.
    let lines = objects(&[
        "demo",
        "--explore",
        "--once",
        "--picture",
        picture.to_str().unwrap(),
        "--http-listen",
        "127.0.0.1:0",
        "--grpc-listen",
        "127.0.0.1:0",
    ]);
    let (explored, ways) = lines.split_last().unwrap();
    assert_eq!(explored["collided"], false);
    assert!(explored["mapped"].as_f64().unwrap() >= 0.95, "{explored}");
    assert!(ways.len() > 10 && ways.iter().all(|way| way["error_m"].as_f64().unwrap() < 0.05));
    assert!(std::fs::read_to_string(&picture).unwrap().contains(">path</text>"));
}
