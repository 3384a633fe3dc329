//! Streams of questions, of which later ones leave out the body.

use std::time::Duration;

use super::{at, ball, row_of_voxels};
use crate::support::daemon::PATIENCE;

#[tokio::test]
async fn a_stream_of_checks_has_its_body_once() {
    use mrol::wire::pb;
    let (daemon, _, _) = row_of_voxels().await;
    let body = pb::Body {
        links: vec![pb::Link {
            spheres_f32le: [0.0f32, 0.0, 0.0, 0.15].iter().flat_map(|c| c.to_le_bytes()).collect(),
            ..Default::default()
        }],
    };
    let request = |body: Option<pb::Body>, map: &str, y: f32| pb::CheckPosesRequest {
        asked: Some(pb::Asked { map: map.into(), ..Default::default() }),
        body,
        configurations_f32le: at(0.55, y, 0.05).iter().flat_map(|c| c.to_le_bytes()).collect(),
        ..Default::default()
    };
    let requests = [request(Some(body), "a", 0.2), request(None, "", 0.4), request(None, "", 0.2)];
    let mut occupancy = daemon.occupancy().await;
    let mut answers = occupancy.check_poses_stream(tokio_stream::iter(requests)).await.unwrap().into_inner();
    let mut colliding = Vec::new();
    while let Some(answer) = answers.message().await.unwrap() {
        colliding.push(answer.collisions.unwrap().colliding_count);
    }
    assert_eq!(colliding, [1, 0, 1]);
}

#[tokio::test]
async fn a_stream_keeps_a_small_body_of_a_large_message_and_no_more() {
    use mrol::wire::pb;
    let (daemon, _, _) = row_of_voxels().await;
    let poses: Vec<u8> = at(0.55, 9.0, 0.05).repeat(20_000).iter().flat_map(|c| c.to_le_bytes()).collect();
    let request = pb::CheckPosesRequest {
        asked: Some(pb::Asked { map: "a".into(), ..Default::default() }),
        body: Some((&*ball(0.15)).into()),
        configurations_f32le: poses.into(),
        ..Default::default()
    };
    let (requests, read) = tokio::sync::mpsc::channel(1);
    requests.send(request).await.unwrap();
    let requests_of = tokio_stream::wrappers::ReceiverStream::new(read);
    let mut occupancy = daemon.occupancy().await;
    let mut answers = occupancy.check_poses_stream(requests_of).await.unwrap().into_inner();
    assert_eq!(answers.message().await.unwrap().unwrap().collisions.unwrap().checked, 20_000);
    // The metric is as of the last second.
    let is_small = async {
        while !(1.0..1024.0).contains(&daemon.metric("mrol_body_bytes").await.unwrap()) {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    tokio::time::timeout(PATIENCE, is_small).await.expect("little is kept, and not nothing");
}
