//! Questions at a level, a revision and an incarnation of the map.

use super::{at, framed, map, poses, row_and_crate};

use mrol::service::{CheckAs, PoseCheck, QuestionScope};
use serde_json::{Value, json};

use crate::support::daemon::json_of;

#[tokio::test]
async fn every_question_takes_a_level_a_revision_and_the_uuid_of_the_map() {
    let (daemon, client, replica) = row_and_crate().await;
    let body = json!({"links": [{"spheres": [[0, 0, 0, 0.1]]}]});
    let pose = at(0.5, 0.5, 0.0);
    for (route, asked) in [
        ("poses", json!({"body": body, "configurations": [pose]})),
        ("motions", json!({"body": body, "configurations": [pose, pose], "lengths": [2]})),
        ("spheres", json!({"spheres": [[0.5, 0.5, 0, 0.1]]})),
        ("rays", json!({"origins": [[0.5, 0.5, 0]], "directions": [[0, 1, 0]]})),
        ("nearest", json!({"points": [[0.5, 0.5, 0]], "radius_m": 1})),
        ("grid", json!({})),
    ] {
        let with = |field: &str, value: Value| {
            let mut asked = asked.clone();
            asked[field] = value;
            asked
        };
        let path = format!("/v1/maps/a/{route}");
        for (field, value, reason) in [
            ("level", json!(9), "level_out_of_range"),
            ("map_uuid", json!("00000000-0000-4000-8000-000000000001"), "map_replaced"),
        ] {
            let said = json_of(daemon.post(&path, with(field, value.clone())).await).await;
            assert_eq!(said["reason"], reason, "{route}: {said}");
            let framed = framed(&with(field, value), &[]);
            assert_eq!(json_of(daemon.post_bytes(&path, framed).await).await["reason"], reason, "{route}");
        }
        let said = json_of(daemon.post(&path, with("min_revision", json!(2))).await).await;
        assert_eq!(said["revision"], 2, "{route}: {said}");
    }
    // In a stream each batch says so for itself.
    let batch = |ignore_keep_outs| PoseCheck {
        asked: QuestionScope { ignore_keep_outs, min_revision: Some(2), ..QuestionScope::default() },
        configurations: at(0.55, 1.5, 0.05).to_vec(),
        ..poses(CheckAs::Colliding)
    };
    let batches = tokio_stream::iter([batch(false), batch(true)]);
    let mut answers = client.pose_stream(&map(), batches).await.unwrap();
    for words in [[1], [0]] {
        assert_eq!(tokio_stream::StreamExt::next(&mut answers).await.unwrap().unwrap().answer.words(), words);
    }
    let late = PoseCheck {
        asked: QuestionScope { min_revision: Some(3), ..QuestionScope::default() },
        ..batch(false)
    };
    assert!(replica.ask(&late).unwrap_err().to_string().contains("the copy is at 2"));
}
