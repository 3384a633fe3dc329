//! What a node asks another for its callers: over gRPC, under the secret of their cluster.

mod log;
mod nodes;

use mrol::access::{Access, Scope, Secret};
use mrol::client::{ClientError, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{KeepOutName, KeepOutShape, MapName, Region, RobotName};
use mrol::mapping::Guess;
use mrol::service::{
    DeleteKeepOut, Deletion, DeletionTarget, EventMessage, EventsQuery, PutKeepOut, ScanRequest, Undo,
    UndoTarget,
};

use self::nodes::Nodes;
use crate::authorization::keyring::Keyring;

/// Of one point at `x_m`, taken as it is.
fn scan(robot: &str, x_m: f32) -> ScanRequest {
    let points = vec![Point::new(x_m, 0.05, 0.05)].into();
    let guess = Guess::Pose(Pose::identity());
    ScanRequest { guess, at_guess: true, ..ScanRequest::new(RobotName::new(robot).unwrap(), points) }
}

/// Of the point of `scan(_, 0.05)`.
fn deletion() -> Deletion {
    let target = DeletionTarget::Points(vec![Point::new(0.05, 0.05, 0.05)].into());
    Deletion { target, level: 0, request_id: None }
}

fn keep_out() -> PutKeepOut {
    let shape = KeepOutShape::of_region(Region::ball([0.0; 3], 1.0).unwrap()).unwrap();
    PutKeepOut { name: KeepOutName::new("k").unwrap(), shape, expires_at_ns: None, request_id: None }
}

#[track_caller]
fn reason<T>(answer: Result<T, ClientError>) -> String {
    answer.map(drop).unwrap_err().reason().unwrap().to_owned()
}

/// Two nodes with the same keys, one of each scope, and one that `b` alone knows.
struct Keyed {
    nodes: Nodes,
    of_cluster: Secret,
    reader: Secret,
    keeper: Secret,
    stranger: Secret,
}

impl Keyed {
    async fn start() -> Self {
        let (of_a, of_b) = (Keyring::empty(), Keyring::empty());
        let reader = of_a.add("reader", Scope::Read, None);
        let keeper = of_a.add("keeper", Scope::Write, None);
        std::fs::copy(of_a.file(), of_b.file()).unwrap();
        let stranger = of_b.add("stranger", Scope::Write, None);
        let of_cluster = Secret::random().unwrap();
        let access = [&of_a, &of_b].map(|keyring| {
            Access::by_keys_of(&keyring.file(), true).unwrap().with_cluster_secret(&of_cluster)
        });
        let nodes = Nodes::start(access, Some(&of_cluster)).await;
        Self { nodes, of_cluster, reader, keeper, stranger }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_follower_is_asked_the_leader_makes_under_the_name_of_the_callers_key() {
    let Keyed { nodes, keeper, .. } = Keyed::start().await;
    let (map, b) = (&nodes.map, nodes.b.client(Some(&keeper)).await);
    assert!(b.insert_scan(map, scan("r", 0.05)).await.unwrap().accepted);
    b.put_keep_out(map, keep_out()).await.unwrap();
    let made_by = nodes.a.service.list_keep_outs(map).await.unwrap().keep_outs[0].made_by.clone();
    assert_eq!(made_by.unwrap().as_str(), "keeper");
    let name = KeepOutName::new("k").unwrap();
    b.delete_keep_out(map, DeleteKeepOut { name, request_id: None }).await.unwrap();
    assert_eq!(b.delete_voxels(map, deletion()).await.unwrap().removed, 1);
    let target = UndoTarget::RobotSince { robot: RobotName::new("r").unwrap(), revision: 0 };
    assert_eq!(b.undo(map, Undo { target, request_id: None }).await.unwrap().scans, 1);
    assert_eq!(b.list_events(map, EventsQuery::default()).await.unwrap().len(), 1);
    assert_eq!(b.map_info(map).await.unwrap().sightings[0].robot.as_str(), "r");
    let mut watch = b.watch_events(map, EventsQuery::default()).await.unwrap();
    loop {
        if let EventMessage::Event(event) = watch.next().await.unwrap().unwrap() {
            assert_eq!(event.robot.as_str(), "r");
            break;
        }
    }
    assert_eq!(nodes.b.service.follow_map(map, None).await.unwrap().revision, 5);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_the_leader_refuses_is_told_in_its_words() {
    let Keyed { nodes, keeper, stranger, reader, .. } = Keyed::start().await;
    let map = &nodes.map;
    let of_key = async |key| nodes.b.client(Some(key)).await.delete_voxels(map, deletion()).await;
    assert_eq!(reason(of_key(&reader).await), "scope_too_small");
    // `b` knows its key, and the node that leads does not.
    let unknown = of_key(&stranger).await.unwrap_err();
    assert_eq!(unknown.reason(), Some("key_unknown"));
    assert!(unknown.to_string().contains("key stranger is not known on the node that leads"), "{unknown}");
    let name = KeepOutName::new("none").unwrap();
    let missing = DeleteKeepOut { name, request_id: None };
    let [direct, forwarded] = [&nodes.a, &nodes.b].map(|node| node.client(Some(&keeper)));
    let direct = direct.await.delete_keep_out(map, missing.clone()).await.unwrap_err();
    assert_eq!(forwarded.await.delete_keep_out(map, missing).await.unwrap_err(), direct);
    assert_eq!(direct.reason(), Some("keep_out_not_found"));
}

#[tokio::test(flavor = "multi_thread")]
async fn the_secret_of_the_cluster_opens_what_nodes_forward_once_and_nothing_else() {
    let Keyed { nodes, of_cluster, .. } = Keyed::start().await;
    let (map, secret) = (&nodes.map, Some(&of_cluster));
    let by_node = nodes.a.client_of_node(secret, Some("keeper")).await;
    assert!(by_node.insert_scan(map, scan("r", 0.05)).await.unwrap().accepted);
    assert_eq!(by_node.delete_voxels(map, deletion()).await.unwrap().removed, 1);
    // Another node asks `b`, which does not lead and takes it no further.
    let second_hop = nodes.b.client_of_node(secret, Some("keeper")).await;
    assert_eq!(reason(second_hop.delete_voxels(map, deletion()).await), "not_leader");
    let for_reader = nodes.a.client_of_node(secret, Some("reader")).await;
    assert_eq!(reason(for_reader.delete_voxels(map, deletion()).await), "scope_too_small");
    let for_nobody = nodes.a.client_of_node(secret, None).await;
    assert_eq!(reason(for_nobody.delete_voxels(map, deletion()).await), "key_missing");
    let new_map = MapName::new("new").unwrap();
    assert_eq!(reason(by_node.create_map(&new_map, NewMap::of(0.1)).await), "scope_too_small");
    assert_eq!(reason(by_node.list_maps().await), "scope_too_small");
    // Without the name of a node it is no key.
    let plain = nodes.a.client(secret).await;
    assert_eq!(reason(plain.delete_voxels(map, deletion()).await), "key_unknown");
}

#[tokio::test(flavor = "multi_thread")]
async fn who_has_a_key_and_says_that_it_is_a_node_is_the_holder_of_its_key() {
    let Keyed { nodes, reader, keeper, .. } = Keyed::start().await;
    let map = &nodes.map;
    for node in [&nodes.a, &nodes.b] {
        let forged = node.client_of_node(Some(&reader), Some("keeper")).await;
        assert_eq!(reason(forged.delete_voxels(map, deletion()).await), "scope_too_small");
        let without = node.client_of_node(None, Some("keeper")).await;
        assert_eq!(reason(without.delete_voxels(map, deletion()).await), "key_missing");
    }
    // It is taken on as its own, and not refused as what a node asks.
    let own = nodes.b.client_of_node(Some(&keeper), Some("reader")).await;
    own.put_keep_out(map, keep_out()).await.unwrap();
    let made_by = nodes.a.service.list_keep_outs(map).await.unwrap().keep_outs[0].made_by.clone();
    assert_eq!(made_by.unwrap().as_str(), "keeper");
}

#[tokio::test(flavor = "multi_thread")]
async fn nodes_without_keys_ask_each_other_for_anybody() {
    let nodes = Nodes::start([Access::open(), Access::open()], None).await;
    let b = nodes.b.client(None).await;
    assert!(b.insert_scan(&nodes.map, scan("r", 0.05)).await.unwrap().accepted);
    let second_hop = nodes.b.client_of_node(None, None).await;
    assert_eq!(reason(second_hop.delete_voxels(&nodes.map, deletion()).await), "not_leader");
}

#[tokio::test(flavor = "multi_thread")]
async fn scans_that_come_while_the_lead_moves_are_all_taken() {
    const SCANS: usize = 60;
    let Keyed { nodes, keeper, .. } = Keyed::start().await;
    let send = async |node: &nodes::Node, robot: &str| {
        let client = node.client(Some(&keeper)).await;
        for n in 0..SCANS {
            let answer = client.insert_scan(&nodes.map, scan(robot, n as f32 + 0.05)).await.unwrap();
            assert!(answer.accepted, "{robot} {n}");
        }
    };
    let hand_over = async {
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        nodes.hand_over().await;
        nodes.a.service.follow_map(&nodes.map, None).await.unwrap();
    };
    tokio::join!(send(&nodes.a, "r"), send(&nodes.b, "s"), hand_over);
    assert_eq!(nodes.b.service.map_info(&nodes.map).await.unwrap().scans, 2 * SCANS);
}
