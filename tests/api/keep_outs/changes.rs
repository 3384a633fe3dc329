//! Putting and removing: revisions, requests that are done once, restarts, undo.

use super::{ROUTE, client_of, listed, map, name, names, now_ns, put, started};

use mrol::map::{KeepOutShape, Prism};
use mrol::service::{DeleteKeepOut, PutKeepOut};
use reqwest::StatusCode;
use serde_json::json;

use crate::support::daemon::{Daemon, json_of, row};

#[tokio::test]
async fn a_keep_out_is_put_replaced_and_removed_each_by_a_revision_and_no_voxel_changes() {
    let daemon = started().await;
    let before = json_of(daemon.get("/v1/maps/a").await).await;
    let cube = json!({"box": {"min_m": [0, 0, 0], "max_m": [2.5, 2.5, 2]}});
    let made = json_of(daemon.put(&format!("{ROUTE}/dock"), cube).await).await;
    assert_eq!((&made["revision"], &made["replayed"]), (&json!(2), &json!(false)));
    assert_eq!(made["content_hash"], before["content_hash"]);
    let prism = json!({"corners_m": [[0, 0], [4, 0], [4, 3]], "z_from_m": -1, "z_to_m": 2.5});
    let at = now_ns() + 3_600_000_000_000;
    let body = json!({"prism": prism, "expires_at_ns": at});
    assert_eq!(json_of(daemon.put(&format!("{ROUTE}/dock"), body).await).await["revision"], 3);
    let pose = json!({"translation_m": [1.0, 2.0, 3.0], "rotation_xyzw": [0.0, 0.6, 0.0, 0.8]});
    let turned = json!({"map_from_box": pose, "size_m": [1.0, 2.0, 3.0]});
    daemon.put(&format!("{ROUTE}/arm"), json!({"oriented_box": turned})).await;
    let all = listed(&daemon).await;
    assert_eq!(all["revision"], 4);
    let prism = json!({"corners_m": [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]], "z_from_m": -1.0, "z_to_m": 2.5});
    let expected = json!([
        {"name": "arm", "oriented_box": turned, "made_revision": 4},
        {"name": "dock", "prism": prism, "made_revision": 3, "expires_at_ns": at},
    ]);
    assert_eq!(all["keep_outs"], expected);
    let gone = json_of(daemon.delete(&format!("{ROUTE}/dock")).await).await;
    assert_eq!((&gone["revision"], &gone["content_hash"]), (&json!(5), &before["content_hash"]));
    let absent = daemon.delete(&format!("{ROUTE}/dock")).await;
    assert_eq!(absent.status(), StatusCode::NOT_FOUND);
    assert_eq!(json_of(absent).await["reason"], "keep_out_not_found");
    assert_eq!((names(&daemon).await, daemon.contents("a").await.1.len()), (vec!["arm".to_owned()], 10));
}

#[tokio::test]
async fn the_client_puts_lists_and_removes_what_http_shows() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    let prism = Prism::new(&[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]], [-1.0, 2.5]).unwrap();
    let keep_out = PutKeepOut { expires_at_ns: Some(i64::MAX), ..put("stage", KeepOutShape::Prism(prism)) };
    let answer = client.put_keep_out(&map("a"), keep_out.clone()).await.unwrap();
    assert_eq!((answer.version.revision, answer.replayed), (2, false));
    let all = client.list_keep_outs(&map("a")).await.unwrap();
    assert_eq!((all.version, all.keep_outs.len()), (answer.version, 1));
    let kept = &all.keep_outs[0];
    assert_eq!((&kept.name, &kept.shape), (&keep_out.name, &keep_out.shape));
    assert_eq!((kept.expires_at_ns, kept.made_revision), (Some(i64::MAX), 2));
    assert_eq!(names(&daemon).await, ["stage"]);
    let removal = DeleteKeepOut { name: name("stage"), request_id: None };
    assert_eq!(client.delete_keep_out(&map("a"), removal.clone()).await.unwrap().version.revision, 3);
    let gone = client.delete_keep_out(&map("a"), removal).await.unwrap_err().to_string();
    assert!(gone.contains("map a has no keep-out stage"), "{gone}");
}

#[tokio::test]
async fn the_same_request_is_done_once_also_across_a_restart() {
    let daemon = started().await;
    let sphere =
        |radius: f64| json!({"sphere": {"center_m": [0, 0, 0], "radius_m": radius}, "request_id": "k-1"});
    let route = format!("{ROUTE}/dock");
    let first = json_of(daemon.put(&route, sphere(1.0)).await).await;
    daemon.put_in("a", &row(12)).await;
    let again = json_of(daemon.put(&route, sphere(1.0)).await).await;
    assert_eq!((&again["revision"], &again["replayed"]), (&first["revision"], &json!(true)));
    let gone = json_of(daemon.delete(&format!("{route}?request_id=k-2")).await).await;
    assert_eq!(gone["revision"], 4);
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    let again = json_of(daemon.put(&route, sphere(1.0)).await).await;
    assert_eq!((&again["revision"], &again["replayed"]), (&json!(2), &json!(true)));
    let again = json_of(daemon.delete(&format!("{route}?request_id=k-2")).await).await;
    assert_eq!((&again["revision"], &again["replayed"]), (&json!(4), &json!(true)));
    for refused in
        [daemon.put(&route, sphere(2.0)).await, daemon.delete(&format!("{route}?request_id=k-1")).await]
    {
        assert_eq!(refused.status(), StatusCode::CONFLICT);
        assert_eq!(json_of(refused).await["reason"], "request_id_taken");
    }
    // A deletion of voxels may have the same id.
    let deletion = json!({"points": row(1), "request_id": "k-1"});
    assert_eq!(json_of(daemon.post("/v1/maps/a/deletions", deletion).await).await["removed"], 1);
    assert!(names(&daemon).await.is_empty());
}

#[tokio::test]
async fn a_keep_out_survives_a_restart_and_goes_with_its_map_file() {
    let daemon = started().await;
    let sphere = json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}});
    daemon.put(&format!("{ROUTE}/dock"), sphere).await;
    let before = listed(&daemon).await;
    let daemon = Daemon::start_in(daemon.stop().await, |_| {}).await;
    assert_eq!(listed(&daemon).await, before);
    let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();
    let client = client_of(&daemon).await;
    client.restore_map(&map("b"), file).await.unwrap();
    let restored = client.list_keep_outs(&map("b")).await.unwrap();
    assert_eq!(restored.keep_outs, client.list_keep_outs(&map("a")).await.unwrap().keep_outs);
}

#[tokio::test]
async fn a_keep_out_is_no_change_that_undo_takes_back_and_undo_of_others_leaves_it() {
    let daemon = started().await;
    let sphere = json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}});
    daemon.put(&format!("{ROUTE}/dock"), sphere).await;
    daemon.post("/v1/maps/a/deletions", json!({"points": row(3)})).await;
    let undo = async |revision: u64| daemon.post("/v1/maps/a/undo", json!({"revision": revision})).await;
    let refused = undo(2).await;
    assert_eq!(refused.status(), StatusCode::PRECONDITION_FAILED);
    let refused = json_of(refused).await;
    assert_eq!(refused["reason"], "not_undoable");
    assert!(
        refused["detail"].as_str().unwrap().contains("revision 2 of map a put or ended a keep-out"),
        "{refused}"
    );
    assert_eq!(json_of(undo(3).await).await["restored"], 3);
    assert_eq!(json_of(undo(1).await).await["removed"], 10);
    assert_eq!((names(&daemon).await, daemon.contents("a").await.1.len()), (vec!["dock".to_owned()], 0));
}
