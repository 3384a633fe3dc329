//! Many watch a map's events at a follower.

use std::time::Duration;

use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::{EventMessage, EventsQuery, ScanRequest};

use crate::site::{NODES, Site};

/// More than a connection between two nodes takes.
const WATCHES: usize = 150;
/// How long nothing may be told while scans are sent: less than a watch that stands still is let be.
const STILL_MAX: Duration = Duration::from_secs(15);
/// As many as a client's own connection takes.
const OF_A_CLIENT: usize = 75;

/// Events of scans that are refused, some kilobytes each: more than a connection has room for.
const EVENTS: u64 = 3_000;

/// A site that takes enough watches, with a map.
fn begin() -> Option<(Site, MapName)> {
    let site = Site::start_with(&[("MROL_LIMITS__CALLER_WATCHES_MAX", "200")])?;
    let map = MapName::new("hall").unwrap();
    site.create(&map);
    site.insert(&site.all_grpc(0), &map, 1, Point::new(1.0, 0.0, 0.0));
    Some((site, map))
}

#[test]
fn watches_that_stand_still_at_a_follower_keep_no_event_from_others() {
    let Some((site, map)) = begin() else { return };
    let leader = site.leader(&map);
    let follower = site.client(&site.grpc((leader + 1) % NODES));
    let still = site.client(&site.grpc((leader + 1) % NODES));
    let runtime = site.runtime();
    let watch = || runtime.block_on(still.watch_events(&map, EventsQuery::default())).unwrap();
    let _still: Vec<_> = (0..OF_A_CLIENT).map(|_| watch()).collect();
    let mut watched = runtime.block_on(follower.watch_events(&map, EventsQuery::default())).unwrap();
    let points: Vec<_> = (0..40).map(|i| Point::new(i as f32 * 0.1, 50.0, 1.0)).collect();
    let send = site.client(&site.grpc(leader));
    let robot = RobotName::new("lost").unwrap();
    let sent = runtime.spawn(async move {
        for number in 0..EVENTS {
            let scan = ScanRequest {
                scan_id: Some(number),
                guess: Guess::Pose(Pose::identity()),
                ..ScanRequest::new(robot.clone(), points.clone().into())
            };
            assert!(!send.insert_scan(&map, scan).await.unwrap().accepted);
        }
    });
    for told in 0..EVENTS {
        let event =
            async { while !matches!(watched.next().await.unwrap().unwrap(), EventMessage::Event(_)) {} };
        let event = async { tokio::time::timeout(STILL_MAX, event).await };
        assert!(runtime.block_on(event).is_ok(), "nothing more was told after {told} events");
    }
    runtime.block_on(sent).unwrap();
}

#[test]
fn whoever_watches_at_a_follower_keeps_no_change_from_the_leader() {
    let Some((site, map)) = begin() else { return };
    let follower = (site.leader(&map) + 1) % NODES;
    let mut watches = Vec::new();
    for _ in 0..WATCHES / OF_A_CLIENT {
        let client = site.client(&site.grpc(follower));
        for _ in 0..OF_A_CLIENT {
            let watch = site.runtime().block_on(client.watch_events(&map, EventsQuery::default()));
            watches.push(watch.unwrap());
        }
    }
    assert_eq!(site.insert(&site.grpc(follower), &map, 2, Point::new(2.0, 0.0, 0.0)), 2);
    drop(watches);
}
