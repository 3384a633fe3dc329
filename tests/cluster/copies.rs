//! Maps that some of the nodes hold: a client of any node goes on to those, also when one is killed and when the map
//! moves.

use std::process::Command;
use std::time::Instant;

use mrol::client::{Client, ClientError};
use mrol::geometry::{Point, Pose};
use mrol::map::{Lookup, MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::{PointQuery, ScanRequest};
use serde_json::Value;

use crate::TURN;
use crate::site::{NODES, Site, WITHIN};

/// A scan of a voxel of its own, under its number.
fn scan(number: u64) -> ScanRequest {
    let points = vec![Point::new(0.25 + number as f32 * 0.5, 0.25, 0.25)].into();
    ScanRequest {
        scan_id: Some(number),
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("robot").unwrap(), points)
    }
}

/// Asks a node over HTTP and follows nowhere: the status, the address that it names, and the body.
fn described(site: &Site, node: usize, map: &MapName) -> (u16, Option<String>, Value) {
    let asked = async {
        let client = reqwest::Client::builder().redirect(reqwest::redirect::Policy::none()).build().unwrap();
        let answer = client.get(format!("{}/v1/maps/{map}", site.http(node))).send().await.unwrap();
        let location = answer.headers().get("location").map(|it| it.to_str().unwrap().to_owned());
        (answer.status().as_u16(), location, answer.json().await.unwrap())
    };
    site.runtime().block_on(asked)
}

/// Waits until a node has a copy of the map, or names another node for it.
#[track_caller]
fn wait_for_status(site: &Site, node: usize, map: &MapName, status: u16) {
    let begun = Instant::now();
    loop {
        let described = described(site, node, map);
        if described.0 == status {
            return;
        }
        assert!(begun.elapsed() < WITHIN, "node {node}: {described:?}");
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
}

/// Inserts a scan, again where the map has no leader for a while.
#[track_caller]
fn insert(site: &Site, client: &Client, map: &MapName, number: u64) -> u64 {
    let begun = Instant::now();
    loop {
        let error = match site.runtime().block_on(client.insert_scan(map, scan(number))) {
            Ok(answer) => return answer.version.revision,
            Err(error) => error,
        };
        let passing = ["no_quorum", "not_leader", "outcome_unknown", "map_elsewhere"];
        let is_passing = error.reason().is_some_and(|reason| passing.contains(&reason))
            || matches!(error, ClientError::Unreachable { .. } | ClientError::Lost { .. });
        assert!(is_passing && begun.elapsed() < WITHIN, "{error}");
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
}

#[test]
fn clients_go_on_to_the_nodes_that_hold_a_map() {
    let _turn = TURN.lock();
    let Some(mut site) = Site::start_with(&[("MROL_CLUSTER__COPIES", "2")]) else { return };
    let map = MapName::new("hall").unwrap();
    site.create(&map);
    let statuses: Vec<u16> = (0..NODES).map(|node| described(&site, node, &map).0).collect();
    let third = statuses.iter().position(|status| *status == 307).expect("two nodes hold it");
    let holders: Vec<usize> = (0..NODES).filter(|node| *node != third).collect();
    holders.iter().for_each(|node| wait_for_status(&site, *node, &map, 200));

    // Over HTTP the third node names the others, with the same path.
    let (_, location, problem) = described(&site, third, &map);
    let location = location.unwrap();
    let places = holders.iter().map(|node| format!("{}/v1/maps/hall", site.http(*node)));
    assert!(places.into_iter().any(|place| place == location), "{location}");
    assert_eq!(problem["reason"], "map_elsewhere");
    assert_eq!(problem["elsewhere"].as_array().unwrap().len(), 2, "{problem}");

    // A client of its address alone does everything there.
    let client = site.client(&site.grpc(third));
    for number in 0..5 {
        assert_eq!(insert(&site, &client, &map, number), number + 1);
    }
    let query = |number: u64| PointQuery {
        points: vec![Point::new(0.25 + number as f32 * 0.5, 0.25, 0.25)].into(),
        map_from_points: None,
        level: 0,
        lookup: Lookup::Exact,
        min_revision: None,
        map_uuid: None,
        keep_out: false,
    };
    let answer = site.runtime().block_on(client.query_points(&map, query(4))).unwrap();
    assert_eq!((answer.version.revision, answer.points_occupied), (5, 1));
    let listed = site.runtime().block_on(client.list_maps()).unwrap();
    assert!(listed.maps.is_empty() && listed.elsewhere.len() == 1, "{listed:?}");
    assert_eq!((&listed.elsewhere[0].name, listed.elsewhere[0].holders.len()), (&map, 2));
    // A stream of a client that knows nothing yet is refused once, and the next one goes there.
    let streaming = site.client(&site.grpc(third));
    let stream = || {
        site.runtime().block_on(async {
            let scans = tokio_stream::iter([scan(5)]);
            streaming.insert_scans(&map, scans).await?.next().await.unwrap()
        })
    };
    assert_eq!(stream().unwrap_err().reason(), Some("map_elsewhere"));
    assert!(stream().unwrap().accepted);

    // One that holds it is killed: the other goes on, for the same client.
    let led = site.leader(&map);
    let left = *holders.iter().find(|node| **node != led).unwrap();
    let begun = Instant::now();
    site.kill_node(led);
    assert_eq!(insert(&site, &client, &map, 6), 7);
    println!("changed again after {:?}", begun.elapsed());
    assert_eq!(site.runtime().block_on(client.query_points(&map, query(5))).unwrap().points_occupied, 1);

    // The map moves to the third node.
    let begun = Instant::now();
    let moved = Command::new(env!("CARGO_BIN_EXE_mrol"))
        .args(["cluster", "copies", "hall", &format!("n{third}"), "--nats", &site.nats.urls().join(",")])
        .output()
        .unwrap();
    assert!(moved.status.success(), "{moved:?}");
    for number in 7..12 {
        assert_eq!(insert(&site, &client, &map, number), number + 1);
    }
    wait_for_status(&site, left, &map, 307);
    println!("moved after {:?}", begun.elapsed());
    wait_for_status(&site, third, &map, 200);
    assert_eq!(insert(&site, &client, &map, 12), 13);
    site.start_node(led);
    site.wait_until_ready(led);
    wait_for_status(&site, led, &map, 307);
    let state = site.state(third, &map).unwrap();
    assert_eq!((state.revision, state.scans, state.voxels), (13, 13, 13));
    for node in 0..NODES {
        assert_eq!(site.state(node, &map), Some(state), "a client of node {node}");
    }
    // A map is deleted by way of any node.
    site.delete(led, &map);
    (0..NODES).for_each(|node| wait_for_status(&site, node, &map, 404));
}
