//! What became of the scans that robots sent: kept, listed, and told as it comes, over both protocols.

use std::sync::Arc;
use std::time::Duration;

use mrol::client::{Answers, Client};
use mrol::map::{MapName, RobotName};
use mrol::service::{EventMessage, EventsQuery, ScanEvent};
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};

use crate::support::daemon::{Daemon, PATIENCE, client, corner, identity_json, json_of, pose_json, row};
use crate::support::description::check;

async fn client_of(daemon: &Daemon) -> Client {
    Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap()
}

fn map_a() -> MapName {
    MapName::new("a").unwrap()
}

/// A map, and three scans sent to it: one that is accepted, one that is refused, and one that has no returns.
async fn three_scans(daemon: &Daemon) {
    daemon.make_map("a").await;
    let refused = json!({"robot": "r1", "session": "s", "scan_id": 7, "points": corner(),
                         "guess": pose_json([500.0, 0.0, 0.0])});
    let failed = json!({"robot": "r2", "points": [[null, 0, 0]], "guess": identity_json()});
    for scan in [json!({"robot": "r1", "points": corner(), "guess": identity_json()}), refused, failed] {
        daemon.post("/v1/maps/a/scans", scan).await;
    }
}

async fn events_of(daemon: &Daemon, parameters: &str) -> Vec<Value> {
    let answer = json_of(daemon.get(&format!("/v1/maps/a/events?{parameters}")).await).await;
    answer["events"].as_array().unwrap_or_else(|| panic!("{answer}")).clone()
}

#[tokio::test]
async fn accepted_refused_and_failed_scans_are_told_with_what_the_robot_was_answered() {
    let daemon = Daemon::start().await;
    three_scans(&daemon).await;
    let events = events_of(&daemon, "").await;
    let [accepted, refused, failed] = &events[..] else { panic!("{events:?}") };
    assert_eq!((&accepted["robot"], &accepted["answer"]["accepted"]), (&json!("r1"), &json!(true)));
    assert_eq!((&accepted["guess"], accepted.get("sample")), (&identity_json(), None));
    assert_eq!(accepted["answer"]["revision"], 1);

    assert_eq!((&refused["session"], &refused["scan_id"]), (&json!("s"), &json!(7)));
    assert_eq!(refused["answer"]["verdict"], "low_overlap");
    assert_eq!(refused["guess"], pose_json([500.0, 0.0, 0.0]));
    let sample: Vec<[f32; 3]> = serde_json::from_value(refused["sample"].clone()).unwrap();
    assert!((100..=300).contains(&sample.len()), "{} points", sample.len());
    assert!(sample.iter().all(|point| corner().contains(point)));

    assert_eq!((&failed["robot"], &failed["answer"]), (&json!("r2"), &Value::Null));
    assert_eq!(failed["error"]["reason"], "no_returns");
    for event in &events {
        assert!(event["duration_ms"].as_f64().unwrap() > 0.0 && event["time_ms"].as_f64().unwrap() > 1e12);
    }
    // The client tells the same.
    let told = client_of(&daemon).await.list_events(&map_a(), EventsQuery::default()).await.unwrap();
    let as_json = |event: &ScanEvent| json!(mrol::json::JsonEvent::from(event));
    for (over_grpc, over_http) in told.iter().map(as_json).zip(&events) {
        for part in ["number", "robot", "scan_id", "points", "guess", "error"] {
            assert_eq!(over_grpc.get(part), over_http.get(part), "{part}");
        }
        let points = |event: &Value| event.get("sample").map(|sample| sample.as_array().unwrap().len());
        assert_eq!(points(&over_grpc), points(over_http));
        assert_eq!(over_grpc["answer"]["reason"], over_http["answer"]["reason"]);
    }
    assert_eq!(told.len(), 3);
}

#[tokio::test]
async fn who_may_not_send_and_who_only_aligns_leaves_no_event() {
    let daemon = Daemon::start().await;
    three_scans(&daemon).await;
    let scan = json!({"robot": "r3", "points": corner(), "guess": identity_json()});
    daemon.post("/v1/maps/a/alignment", scan).await;
    assert_eq!(events_of(&daemon, "").await.len(), 3);
}

#[tokio::test]
async fn a_list_begins_after_a_number_and_is_of_one_robot_where_asked() {
    let daemon = Daemon::start_with(|config| config.limits.events_per_map_max = 2).await;
    three_scans(&daemon).await;
    // The first is gone: its robot sent another one since.
    let events = events_of(&daemon, "").await;
    let numbers: Vec<u64> = events.iter().map(|event| event["number"].as_u64().unwrap()).collect();
    assert_eq!(numbers.len(), 2);
    assert_eq!(events_of(&daemon, &format!("since_number={}", numbers[0])).await, events[1..]);
    assert_eq!(events_of(&daemon, "robot=r1").await, events[..1]);
    assert!(events_of(&daemon, "robot=nobody").await.is_empty());
    for (parameters, reason) in
        [("since_number=-1", "bad_query"), ("robot=a/b", "bad_name"), ("x=1", "bad_query")]
    {
        let refused = json_of(daemon.get(&format!("/v1/maps/a/events?{parameters}")).await).await;
        assert_eq!(refused["reason"], reason, "{parameters}: {refused}");
    }
    let refused = json_of(daemon.get("/v1/maps/b/events").await).await;
    assert_eq!(refused["reason"], "map_not_found");
}

async fn next_event(messages: &mut Answers<EventMessage>) -> Arc<ScanEvent> {
    loop {
        let next = tokio::time::timeout(PATIENCE, messages.next()).await.expect("a message in time");
        if let EventMessage::Event(event) = next.expect("another message").unwrap() {
            return event;
        }
    }
}

#[tokio::test]
async fn a_watch_tells_of_what_is_kept_and_then_of_each_event_as_it_comes() {
    let daemon = Daemon::start_with(|config| config.limits.watch_heartbeat_s = 0.05).await;
    three_scans(&daemon).await;
    let client = client_of(&daemon).await;
    let mut messages = client.watch_events(&map_a(), EventsQuery::default()).await.unwrap();
    let mut told = Vec::new();
    for _ in 0..3 {
        told.push(next_event(&mut messages).await.number);
    }
    let quiet = tokio::time::timeout(PATIENCE, messages.next()).await.unwrap().unwrap().unwrap();
    assert_eq!(quiet, EventMessage::Heartbeat);
    let scan = json!({"robot": "r9", "points": row(20), "guess": identity_json(), "align": false});
    daemon.post("/v1/maps/a/scans", scan).await;
    assert_eq!(next_event(&mut messages).await.robot.as_str(), "r9");
    drop(messages);
    // Who comes back goes on where it was.
    let robot = Some(RobotName::new("r2").unwrap());
    for (since_number, robot, next) in
        [(told[1], None, told[2]), (told[0], robot, told[2]), (u64::MAX, None, told[0])]
    {
        let query = EventsQuery { since_number, robot };
        let mut messages = client.watch_events(&map_a(), query).await.unwrap();
        assert_eq!(next_event(&mut messages).await.number, next);
    }
}

/// The next whole line of an answer.
async fn next_line(answer: &mut Response, rest: &mut String) -> Value {
    loop {
        if let Some((line, after)) = rest.split_once('\n') {
            let line = serde_json::from_str(line).unwrap();
            check(&Method::GET, "/v1/maps/a/events/watch", StatusCode::OK, "application/x-ndjson", &line);
            *rest = after.to_owned();
            return line;
        }
        let chunk = tokio::time::timeout(PATIENCE, answer.chunk()).await.expect("a chunk in time").unwrap();
        rest.push_str(std::str::from_utf8(&chunk.expect("the answer goes on")).unwrap());
    }
}

#[tokio::test]
async fn over_http_a_watch_is_lines_and_the_last_says_why_it_ends() {
    let daemon = Daemon::start_with(|config| config.limits.watch_heartbeat_s = 30.0).await;
    daemon.make_map("a").await;
    let mut answer = client().get(daemon.url("/v1/maps/a/events/watch")).send().await.unwrap();
    assert_eq!(answer.headers()["content-type"], "application/x-ndjson");
    let mut rest = String::new();
    assert_eq!(next_line(&mut answer, &mut rest).await, json!({"heartbeat": true}), "it speaks at once");
    let scan = json!({"robot": "r1", "points": row(20), "guess": identity_json(), "align": false});
    daemon.post("/v1/maps/a/scans", scan).await;
    let event = next_line(&mut answer, &mut rest).await;
    assert_eq!((&event["robot"], &event["answer"]["new_voxels"]), (&json!("r1"), &json!(20)));
    assert_eq!(event, events_of(&daemon, "").await[0]);
    daemon.delete("/v1/maps/a").await;
    let last = next_line(&mut answer, &mut rest).await;
    assert_eq!((&last["error"]["reason"], &last["error"]["status"]), (&json!("map_not_found"), &json!(404)));
    let end = tokio::time::timeout(PATIENCE, answer.chunk()).await.expect("the end in time").unwrap();
    assert_eq!(end, None);
}

#[tokio::test]
async fn watches_of_events_count_among_the_watches() {
    let daemon = Daemon::start_with(|config| config.limits.watches_max = 1).await;
    daemon.make_map("a").await;
    let client = client_of(&daemon).await;
    let held = client.watch_events(&map_a(), EventsQuery::default()).await.unwrap();
    let refused = json_of(daemon.get("/v1/maps/a/events/watch").await).await;
    assert!(refused["detail"].as_str().unwrap().contains("watches_max is 1"), "{refused}");
    drop(held);
    let begin = std::time::Instant::now();
    while client.watch_events(&map_a(), EventsQuery::default()).await.is_err() {
        assert!(begin.elapsed() < PATIENCE, "a dropped watch is still counted");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn a_watch_of_one_robot_has_its_heartbeats_while_others_send() {
    let daemon = Daemon::start_with(|config| config.limits.watch_heartbeat_s = 0.5).await;
    daemon.make_map("a").await;
    let robot = Some(RobotName::new("quiet").unwrap());
    let query = EventsQuery { robot, since_number: 0 };
    let mut messages = client_of(&daemon).await.watch_events(&map_a(), query).await.unwrap();
    assert_eq!(messages.next().await.unwrap().unwrap(), EventMessage::Heartbeat, "it speaks at once");
    let busy = async {
        loop {
            let failing = json!({"robot": "busy", "points": [[null, 0, 0]]});
            daemon.post("/v1/maps/a/scans", failing).await;
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    let next = tokio::time::timeout(PATIENCE, messages.next());
    let heard = tokio::select! {
        next = next => next,
        () = busy => unreachable!(),
    };
    assert_eq!(heard.expect("a heartbeat in time").unwrap().unwrap(), EventMessage::Heartbeat);
}
