//! Operations of which the node that leads makes the changes, asked of one that does not.

use std::collections::BTreeSet;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::Instant;
use tokio_stream::StreamExt;

use super::two_nodes::{TwoNodes, scan_of};
use crate::caller::{AllowedMaps, AllowedScans};
use crate::error::{Reason, ServiceError};
use crate::request::{
    DeleteKeepOut, Deletion, DeletionTarget, EventMessage, EventsQuery, PutKeepOut, Undo, UndoTarget,
};
use mrol_map::geometry::Point;
use mrol_map::map::{CallerName, KeepOutName, KeepOutShape, Region, RobotName};

/// Of the point of `scan_of(_, 0.05)`.
fn deletion() -> Deletion {
    let target = DeletionTarget::Points(vec![Point::new(0.05, 0.05, 0.05)].into());
    Deletion { target, level: 0, request_id: None }
}

fn keep_out() -> PutKeepOut {
    let shape = KeepOutShape::of_region(Region::ball([0.0; 3], 1.0).unwrap()).unwrap();
    PutKeepOut { name: KeepOutName::new("k").unwrap(), shape, expires_at_ns: None, request_id: None }
}

fn undo_of_robot(robot: &str) -> Undo {
    let robot = RobotName::new(robot).unwrap();
    Undo { target: UndoTarget::RobotSince { robot, revision: 0 }, request_id: None }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_follower_is_asked_the_leader_makes_for_the_callers_name() {
    let nodes = TwoNodes::led_by_a().await;
    let (map, b) = (&nodes.map, &nodes.b);
    let caller = CallerName::new("keeper").unwrap();
    let asked = b.service.limited_to(Some(caller.clone()), AllowedMaps::Every, AllowedScans::default());
    assert!(asked.insert_scan(map, scan_of("r", 0.05)).await.unwrap().accepted);
    assert_eq!(asked.put_keep_out(map, keep_out()).await.unwrap().version.revision, 2);
    let made_by = nodes.a.service.list_keep_outs(map).await.unwrap().keep_outs[0].made_by.clone();
    assert_eq!(made_by, Some(caller.clone()));
    let name = KeepOutName::new("k").unwrap();
    asked.delete_keep_out(map, DeleteKeepOut { name, request_id: None }).await.unwrap();
    assert_eq!(asked.delete_voxels(map, deletion()).await.unwrap().removed, 1);
    assert_eq!(asked.undo(map, undo_of_robot("r")).await.unwrap().scans, 1);
    assert_eq!(asked.list_events(map, EventsQuery::default()).await.unwrap().len(), 1);
    assert_eq!(asked.map_info(map).await.unwrap().sightings[0].robot.as_str(), "r");
    let told = [
        "insert_scan",
        "put_keep_out",
        "delete_keep_out",
        "delete_voxels",
        "undo",
        "list_events",
        "sightings",
    ];
    assert_eq!(b.asked(), told);
    assert!(b.other.calls.lock().iter().all(|(_, call)| call.caller.as_ref() == Some(&caller)));
    assert_eq!(b.service.follow_map(map, None).await.unwrap().revision, 5);
    assert!(nodes.a.asked().is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_forwarded_goes_no_further_and_is_refused_at_once() {
    let nodes = TwoNodes::led_by_a().await;
    let (map, b) = (&nodes.map, nodes.b.service.clone().forwarded());
    let refusals = [
        b.insert_scan(map, scan_of("r", 0.05)).await.unwrap_err(),
        b.delete_voxels(map, deletion()).await.unwrap_err(),
        b.undo(map, undo_of_robot("r")).await.unwrap_err(),
        b.put_keep_out(map, keep_out()).await.unwrap_err(),
        b.list_events(map, EventsQuery::default()).await.unwrap_err(),
        b.watch_events(map, EventsQuery::default()).await.map(drop).unwrap_err(),
    ];
    for refusal in refusals {
        assert_eq!(refusal.reason, Reason::NotLeader);
        assert!(refusal.message.contains("node a") && refusal.retry_after.is_some(), "{refusal}");
    }
    assert!(b.map_info(map).await.unwrap().sightings.is_empty());
    assert!(nodes.b.asked().is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_caller_may_not_do_is_refused_before_another_node_is_asked() {
    let nodes = TwoNodes::led_by_a().await;
    let (map, b) = (&nodes.map, &nodes.b.service);
    let elsewhere = b.limited_to(None, AllowedMaps::none(), AllowedScans::default());
    let reason = |answer: Result<(), ServiceError>| answer.unwrap_err().reason;
    for refused in [
        elsewhere.insert_scan(map, scan_of("r", 0.05)).await.map(drop),
        elsewhere.delete_voxels(map, deletion()).await.map(drop),
        elsewhere.undo(map, undo_of_robot("r")).await.map(drop),
        elsewhere.put_keep_out(map, keep_out()).await.map(drop),
        elsewhere.list_events(map, EventsQuery::default()).await.map(drop),
        elsewhere.watch_events(map, EventsQuery::default()).await.map(drop),
        elsewhere.map_info(map).await.map(drop),
    ] {
        assert_eq!(reason(refused), Reason::MapNotAllowed);
    }
    let robots = Some(Arc::new(BTreeSet::from([RobotName::new("other").unwrap()])));
    let scans = AllowedScans { robots, undo_of_others: false, carving_on_request: false };
    let other_robot = b.limited_to(None, AllowedMaps::Every, scans);
    for refused in [
        other_robot.insert_scan(map, scan_of("r", 0.05)).await.map(drop),
        other_robot.undo(map, undo_of_robot("r")).await.map(drop),
    ] {
        assert_eq!(reason(refused), Reason::RobotNotAllowed);
    }
    assert!(nodes.b.asked().is_empty());
}

#[tokio::test]
async fn where_nobody_takes_over_a_caller_hears_so_after_some_seconds() {
    let nodes = TwoNodes::begin().await;
    tokio::time::pause();
    let begin = Instant::now();
    let refused = nodes.b.service.delete_voxels(&nodes.map, deletion()).await.unwrap_err();
    assert_eq!(refused.reason, Reason::NotLeader);
    assert!((Duration::from_secs(5)..Duration::from_secs(6)).contains(&begin.elapsed()));
    assert!(nodes.b.asked().is_empty());
}

#[tokio::test]
async fn a_leader_that_is_gone_is_asked_for_some_seconds_and_no_longer() {
    let nodes = TwoNodes::led_by_a().await;
    let gone = ServiceError::new(Reason::NoQuorum, "node a does not answer");
    *nodes.b.other.fails_with.lock() = Some(gone.clone());
    tokio::time::pause();
    let begin = Instant::now();
    assert_eq!(nodes.b.service.delete_voxels(&nodes.map, deletion()).await, Err(gone));
    assert!((Duration::from_secs(5)..Duration::from_secs(6)).contains(&begin.elapsed()));
    assert!((20..40).contains(&nodes.b.asked().len()), "{}", nodes.b.asked().len());
}

#[tokio::test(flavor = "multi_thread")]
async fn what_has_an_unknown_outcome_is_not_asked_again() {
    let nodes = TwoNodes::led_by_a().await;
    let unknown = ServiceError::new(Reason::OutcomeUnknown, "the connection is lost");
    *nodes.b.other.fails_with.lock() = Some(unknown.clone());
    assert_eq!(nodes.b.service.delete_voxels(&nodes.map, deletion()).await, Err(unknown));
    assert_eq!(nodes.b.asked(), ["delete_voxels"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_description_is_given_where_the_leader_does_not_answer() {
    let nodes = TwoNodes::led_by_a().await;
    *nodes.b.other.fails_with.lock() = Some(ServiceError::new(Reason::NoQuorum, "node a does not answer"));
    let info = nodes.b.service.map_info(&nodes.map).await.unwrap();
    assert!(info.sightings.is_empty());
    assert_eq!(nodes.b.asked(), ["sightings"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_change_waits_for_the_lead_to_come_here() {
    let nodes = TwoNodes::begin().await;
    let change = nodes.b.service.insert_scan(&nodes.map, scan_of("r", 0.05));
    let take_over = async {
        tokio::time::sleep(Duration::from_millis(100)).await;
        nodes.b.lead(&nodes.map).await;
    };
    let (answer, ()) = tokio::join!(change, take_over);
    assert!(answer.unwrap().accepted);
    assert!(nodes.b.asked().is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn to_callers_of_both_nodes_a_hand_over_is_a_delay() {
    let nodes = TwoNodes::led_by_a().await;
    nodes.hand_over().await;
    // `a` waits for `b`, which takes its change; `b` asks `a`, which refuses.
    let of_a = nodes.a.service.insert_scan(&nodes.map, scan_of("r", 0.05));
    let of_b = nodes.b.service.insert_scan(&nodes.map, scan_of("s", 1.05));
    let take_over = async {
        tokio::time::sleep(Duration::from_millis(300)).await;
        nodes.take_over().await;
    };
    let (of_a, of_b, ()) = tokio::join!(of_a, of_b, take_over);
    assert!(of_a.unwrap().accepted && of_b.unwrap().accepted);
    assert!(!nodes.a.asked().is_empty() && !nodes.b.asked().is_empty());
    assert_eq!(nodes.a.service.follow_map(&nodes.map, None).await.unwrap().revision, 2);
    // What was refused on the way is no event, on neither node.
    let events = nodes.b.service.list_events(&nodes.map, EventsQuery::default()).await.unwrap();
    assert_eq!(events.iter().filter(|event| event.answer.is_ok()).count(), events.len());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_watch_of_events_moves_with_the_lead_and_tells_each_event_once() {
    let nodes = TwoNodes::led_by_a().await;
    let watch = nodes.b.service.watch_events(&nodes.map, EventsQuery::default()).await.unwrap();
    let mut messages = pin!(watch.into_stream(std::future::pending()));
    let mut next_robot = async || loop {
        if let EventMessage::Event(event) = messages.next().await.unwrap().unwrap() {
            return event.robot.to_string();
        }
    };
    nodes.a.service.insert_scan(&nodes.map, scan_of("first", 0.05)).await.unwrap();
    assert_eq!(next_robot().await, "first");
    nodes.hand_over().await;
    nodes.take_over().await;
    nodes.b.service.insert_scan(&nodes.map, scan_of("second", 1.05)).await.unwrap();
    assert_eq!(next_robot().await, "second");
    nodes.a.service.follow_map(&nodes.map, None).await.unwrap();
    // And back, to a node that has an event from before.
    nodes.b.service.hand_map_over(&nodes.map, nodes.a.name.clone()).await.unwrap();
    nodes.a.service.follow_map(&nodes.map, None).await.unwrap();
    nodes.a.lead(&nodes.map).await;
    nodes.b.service.follow_map(&nodes.map, None).await.unwrap();
    nodes.a.service.insert_scan(&nodes.map, scan_of("third", 2.05)).await.unwrap();
    assert_eq!(next_robot().await, "third");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_leader_that_does_not_answer_is_waited_for_until_another_leads() {
    let nodes = TwoNodes::led_by_a().await;
    *nodes.b.other.is_silent.lock() = true;
    let (service, map) = (nodes.b.service.clone(), nodes.map.clone());
    let asked = tokio::spawn(async move { service.insert_scan(&map, scan_of("r", 0.05)).await });
    while nodes.b.asked().is_empty() {
        tokio::task::yield_now().await;
    }
    nodes.hand_over().await;
    nodes.take_over().await;
    let unknown = asked.await.unwrap().unwrap_err();
    assert_eq!(unknown.reason, Reason::OutcomeUnknown);
    assert!(nodes.b.service.insert_scan(&nodes.map, scan_of("r", 0.05)).await.unwrap().accepted);
}
