//! Who leads a map that several nodes share.

use super::two_nodes::{TwoNodes, scan_of};
use crate::cluster::NoRoom;
use crate::commit::Lead;
use crate::error::Reason;
use crate::replication::Base;
use crate::request::{Deletion, DeletionTarget, ScanRequest};
use mrol_map::geometry::Point;

#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_chose_to_lead_before_it_knew_that_another_does_follows_it() {
    let nodes = TwoNodes::begin().await;
    let Lead::Shared { epoch, .. } = nodes.b.service.lead_of(&nodes.map).await.unwrap().borrow().clone()
    else {
        panic!("the map is shared")
    };
    nodes.a.service.claim_map(&nodes.map, Some(epoch)).await.unwrap();
    nodes.a.service.open_map(&nodes.map, nodes.a.claim_of(&nodes.map).await, Vec::new()).await.unwrap();
    // `b` sees nobody lead, and has not read what `a` claimed.
    let refused = nodes.b.service.claim_map(&nodes.map, Some(epoch)).await.unwrap_err();
    assert_eq!((refused.reason, refused.message.contains("node a")), (Reason::NotLeader, true), "{refused}");
    assert!(nodes.a.service.insert_scan(&nodes.map, scan_of("r", 0.05)).await.unwrap().accepted);
    // By what it has read now, it may choose to: the one that leads may not answer.
    nodes.b.service.claim_map(&nodes.map, Some(epoch + 1)).await.unwrap();
    nodes.b.service.open_map(&nodes.map, nodes.b.claim_of(&nodes.map).await, Vec::new()).await.unwrap();
    assert!(nodes.b.service.insert_scan(&nodes.map, scan_of("r", 1.05)).await.unwrap().accepted);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_claim_changes_nothing_before_the_others_are_known_to_have_no_more() {
    let nodes = TwoNodes::led_by_a().await;
    nodes.b.service.claim_map(&nodes.map, None).await.unwrap();
    let ahead = vec![(nodes.a.name.clone(), 1)];
    let refused =
        nodes.b.service.open_map(&nodes.map, nodes.b.claim_of(&nodes.map).await, ahead).await.unwrap_err();
    assert_eq!(refused.reason, Reason::NoQuorum, "{refused}");
    let Lead::Shared { is_here, has_claimed, .. } =
        nodes.b.service.lead_of(&nodes.map).await.unwrap().borrow().clone()
    else {
        panic!("the map is shared")
    };
    assert_eq!((is_here, has_claimed), (false, true));
    // What it claimed it may give away: here to the one that is further.
    nodes.b.service.hand_map_over(&nodes.map, nodes.a.name.clone()).await.unwrap();
    let too_late = nodes
        .b
        .service
        .open_map(&nodes.map, nodes.b.claim_of(&nodes.map).await, Vec::new())
        .await
        .unwrap_err();
    assert_eq!(too_late.reason, Reason::NotLeader, "{too_late}");
    nodes.a.lead(&nodes.map).await;
    assert!(nodes.a.service.insert_scan(&nodes.map, scan_of("r", 0.05)).await.unwrap().accepted);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_does_not_lead_where_the_log_begins_at_a_revision_that_it_has_not() {
    let nodes = TwoNodes::begin().await;
    nodes.a.service.claim_map(&nodes.map, None).await.unwrap();
    // A copy that is further was made the base after this node had begun.
    let further = Base { revision: 5, ..nodes.log.0.lock().base().clone() };
    nodes.log.0.lock().cut(further);
    let claim = nodes.a.claim_of(&nodes.map).await;
    let refused = nodes.a.service.open_map(&nodes.map, claim, Vec::new()).await.unwrap_err();
    assert_eq!(refused.reason, Reason::HistoriesDiffer, "{refused}");
    assert!(refused.message.contains("it is at revision 0, and the log begins at 5"), "{refused}");
    let refused = nodes.a.service.insert_scan(&nodes.map, scan_of("r", 0.05)).await.unwrap_err();
    assert_ne!(refused.reason, Reason::OutcomeUnknown, "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn where_another_node_has_no_room_the_map_does_not_grow_and_is_told_by_whom() {
    let nodes = TwoNodes::led_by_a().await;
    let (service, map) = (&nodes.a.service, &nodes.map);
    let made = ScanRequest { scan_id: Some(7), ..scan_of("r", 0.05) };
    assert!(service.insert_scan(map, made.clone()).await.unwrap().accepted);
    let no_room = NoRoom { node: nodes.b.name.clone(), reason: Reason::DiskFull };
    service.set_no_room(map, Some(no_room)).await.unwrap();
    let refused = service.insert_scan(map, scan_of("r", 1.05)).await.unwrap_err();
    assert_eq!((refused.reason, refused.message.contains("node b")), (Reason::DiskFull, true), "{refused}");
    // What was made is known, and what makes room is made.
    assert!(service.insert_scan(map, made).await.unwrap().accepted);
    let target = DeletionTarget::Points(vec![Point::new(0.05, 0.05, 0.05)].into());
    let deletion = Deletion { target, level: 0, request_id: None };
    assert_eq!(service.delete_voxels(map, deletion).await.unwrap().removed, 1);
    service.set_no_room(map, None).await.unwrap();
    assert!(service.insert_scan(map, scan_of("r", 1.05)).await.unwrap().accepted);
}
