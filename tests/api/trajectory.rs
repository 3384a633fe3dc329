//! Trajectories: thinned where undo reaches no more, with ids that stay known, and given out in pages and pieces.

use mrol::config::Config;
use mrol::map::KeptPoses;
use mrol::wire::pb;
use reqwest::StatusCode;
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio_stream::StreamExt;
use tonic::Code;

use crate::support::daemon::{Daemon, client, json_of, pose_json, row, scan_pb};

/// Undo reaches as little as it may.
fn short_undo(config: &mut Config) {
    config.store.undo_revisions = 1;
}

async fn insert(daemon: &Daemon, robot: &str, scan_id: u64, x: f64) -> reqwest::Response {
    let scan = json!({"robot": robot, "scan_id": scan_id, "points": row(3), "guess": pose_json([x, 0.0, 0.0]), "align": false});
    daemon.post("/v1/maps/a/scans", scan).await
}

async fn poses(daemon: &Daemon, query: &str) -> Value {
    let answer = daemon.get(&format!("/v1/maps/a/trajectory{query}")).await;
    assert_eq!(answer.status(), StatusCode::OK, "{query}");
    json_of(answer).await
}

fn ids(trajectory: &Value) -> Vec<u64> {
    trajectory["poses"].as_array().unwrap().iter().map(|pose| pose["scan_id"].as_u64().unwrap()).collect()
}

/// Starts the server anew until undo reaches none of the first scans: each start and end writes a snapshot.
async fn outside_undo_window(mut data: TempDir, first_id: u64) -> Daemon {
    for id in first_id..first_id + 3 {
        let daemon = Daemon::start_in(data, short_undo).await;
        assert_eq!(insert(&daemon, "other", id, 50.0).await.status(), StatusCode::OK);
        data = daemon.stop().await;
    }
    Daemon::start_in(data, short_undo).await
}

#[tokio::test]
async fn a_thinned_scans_id_stays_known_and_inserts_nothing() {
    let daemon = Daemon::start_with(short_undo).await;
    daemon.make_map("a").await;
    for id in 1..=20 {
        insert(&daemon, "r", id, 0.0).await;
    }
    let mut daemon = outside_undo_window(daemon.stop().await, 1).await;
    // Twice: as it was thinned, and as a snapshot has it.
    for round in 0..2 {
        assert_eq!(ids(&poses(&daemon, "?robot=r").await), [1, 19, 20], "round {round}");
        let before = daemon.contents("a").await;
        for id in [2, 18] {
            let refused = insert(&daemon, "r", id, 0.0).await;
            assert_eq!(refused.status(), StatusCode::PRECONDITION_FAILED);
            let error = json_of(refused).await;
            assert_eq!(error["reason"], "scan_id_too_old");
            assert!(
                error["detail"].as_str().unwrap().contains(&format!("scan_id {id} of robot r")),
                "{error}"
            );
        }
        for id in [1, 20] {
            assert_eq!(json_of(insert(&daemon, "r", id, 0.0).await).await["replayed"], true);
        }
        assert_eq!(daemon.contents("a").await, before);
        for target in [json!({"robot": "r", "scan_id": 5}), json!({"revision": 5})] {
            let refused = daemon.post("/v1/maps/a/undo", target).await;
            assert_eq!(refused.status(), StatusCode::PRECONDITION_FAILED);
        }
        daemon = outside_undo_window(daemon.stop().await, 10 + 10 * round).await;
    }
    assert_eq!(insert(&daemon, "r", 21, 0.0).await.status(), StatusCode::OK);
}

#[tokio::test]
async fn a_thinned_trajectory_is_no_illness() {
    let daemon = Daemon::start_with(short_undo).await;
    daemon.make_map("a").await;
    for id in 1..=20 {
        insert(&daemon, "r", id, 0.0).await;
    }
    let mut data = daemon.stop().await;
    let mut thinned = 0;
    for id in 1..=6 {
        let daemon = Daemon::start_in(data, short_undo).await;
        insert(&daemon, "other", id, 50.0).await;
        thinned += usize::from(ids(&poses(&daemon, "?robot=r").await).len() < 20);
        data = daemon.stop().await;
        let mut doctor = std::process::Command::new(env!("CARGO_BIN_EXE_mrol"));
        let told = doctor.args(["doctor", "--json"]).arg(data.path()).output().unwrap();
        let told = String::from_utf8(told.stdout).unwrap();
        let found: Value = serde_json::from_str(told.lines().next().unwrap()).unwrap();
        assert_eq!(found["problems"], json!([]), "after {id} restarts: {told}");
        assert!(found["snapshots"].as_array().unwrap().len() > 1, "there is nothing to compare: {told}");
    }
    assert!(thinned > 1, "nothing was thinned");
}

/// Puts the map file of a map of twenty scans from one place into a new data folder, and starts the server there twice:
/// the number of scans, of kept poses, and of poses in the trajectory.
async fn mapped_restored_and_started_again(keep: KeptPoses) -> (u64, u64, usize) {
    let mapped = Daemon::start().await;
    mapped.make_map("a").await;
    for id in 1..=20 {
        insert(&mapped, "r", id, 0.0).await;
    }
    insert(&mapped, "r", 21, 0.0).await;
    let undone = mapped.post("/v1/maps/a/undo", json!({"robot": "r", "scan_id": 21})).await;
    assert_eq!(undone.status(), StatusCode::OK);
    let file = mapped.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();
    let kept = |config: &mut Config| config.store.keep_trajectory.0 = keep;
    let restored = Daemon::start_with(kept).await;
    let put = client().put(restored.url("/v1/maps/a/snapshot"));
    let put = put.header("content-type", "application/octet-stream").body(file);
    assert_eq!(put.send().await.unwrap().status(), StatusCode::CREATED);
    let mut data = restored.stop().await;
    for _ in 0..2 {
        data = Daemon::start_in(data, kept).await.stop().await;
    }
    let daemon = Daemon::start_in(data, kept).await;
    let told = json_of(daemon.get("/v1/maps/a").await).await;
    let listed = json_of(daemon.get("/v1/maps").await).await;
    assert_eq!((&listed["maps"][0]["scans"], &listed["maps"][0]["poses"]), (&told["scans"], &told["poses"]));
    let count = |field: &str| told[field].as_u64().unwrap();
    (count("scans"), count("poses"), ids(&poses(&daemon, "").await).len())
}

#[tokio::test]
async fn a_restored_map_counts_all_of_its_scans_and_says_how_many_poses_are_kept() {
    assert_eq!(mapped_restored_and_started_again(KeptPoses::Spaced).await, (20, 3, 3));
}

#[tokio::test]
async fn where_every_pose_is_to_be_kept_a_restored_map_has_its_whole_trajectory() {
    assert_eq!(mapped_restored_and_started_again(KeptPoses::All).await, (20, 20, 20));
}

#[tokio::test]
async fn a_page_is_charged_as_the_page_and_not_as_the_trajectory() {
    // Of memory for bodies and answers: room for a page, and not for the pieces of all poses.
    let daemon = Daemon::start_with(|config| {
        config.limits.body_bytes_max = 1 << 20;
        config.limits.message_bytes_max = 1 << 20;
    })
    .await;
    daemon.make_map("a").await;
    for id in 1..=5 {
        insert(&daemon, "r", id, 0.0).await;
    }
    assert_eq!(ids(&poses(&daemon, "?limit=3").await), [1, 2, 3]);
    let refused = daemon.get("/v1/maps/a/trajectory").await;
    assert_eq!(refused.status(), StatusCode::TOO_MANY_REQUESTS, "the whole needs more room than there is");
    assert_eq!(ids(&poses(&daemon, "?limit=10&since_revision=3").await), [4, 5]);
}

#[tokio::test]
async fn a_map_in_memory_is_thinned_too() {
    let daemon = Daemon::start_with(|config| {
        config.data_dir = "".into();
        config.store.undo_revisions = 100;
    })
    .await;
    daemon.make_map("a").await;
    let requests = (1..=5000).map(|id| {
        let mut request = scan_pb("a", "r", &row(1));
        request.scan.as_mut().unwrap().scan_id = Some(id);
        request
    });
    let mut robot = daemon.mapping().await;
    let answers = robot.insert_scan_stream(tokio_stream::iter(requests)).await.unwrap().into_inner();
    assert_eq!(answers.map(Result::unwrap).collect::<Vec<_>>().await.len(), 5000);
    let info = json_of(daemon.get("/v1/maps/a").await).await;
    let poses = info["poses"].as_u64().unwrap();
    assert!((600..=1100).contains(&poses) && info["scans"] == 5000, "{info}");
    assert!(info["trajectory_bytes"].as_u64().unwrap() > poses * 100, "{info}");
}

#[tokio::test]
async fn a_trajectory_comes_in_pages_and_in_pieces() {
    let daemon = Daemon::start_with(|config| config.limits.trajectory_page_max = 100).await;
    daemon.make_map("a").await;
    let requests = (1..=1300u64).map(|id| {
        let mut request = scan_pb("a", ["one", "two"][(id % 2) as usize], &row(1));
        request.scan.as_mut().unwrap().scan_id = Some(id);
        request
    });
    let mut robot = daemon.mapping().await;
    let answers = robot.insert_scan_stream(tokio_stream::iter(requests)).await.unwrap().into_inner();
    assert_eq!(answers.map(Result::unwrap).collect::<Vec<_>>().await.len(), 1300);

    // By gRPC, page by page: where no limit is set, the page is the server's.
    for (limit, pages) in [(0, 13), (100, 13), (99, 14)] {
        let (mut since_revision, mut found, mut count) = (0, Vec::new(), 0);
        loop {
            let request =
                pb::GetTrajectoryRequest { map: "a".into(), since_revision, limit, ..Default::default() };
            let page = robot.get_trajectory(request).await.unwrap().into_inner();
            assert_eq!(page.version.unwrap().revision, 1300);
            found.extend(page.poses.into_iter().map(|pose| pose.revision));
            count += 1;
            match page.next_since_revision {
                Some(next) => since_revision = next,
                None => break,
            }
        }
        assert_eq!((found, count), ((1..=1300).collect(), pages));
    }
    let request = pb::GetTrajectoryRequest { map: "a".into(), limit: 101, ..Default::default() };
    let refused = robot.get_trajectory(request).await.unwrap_err();
    assert_eq!(refused.code(), Code::InvalidArgument);
    assert!(refused.message().contains("trajectory_page_max, which is 100, got 101"), "{refused}");

    // By gRPC, as a stream.
    for (name, since_revision, first, step) in [("", 0, 1, 1), ("one", 0, 2, 2), ("two", 700, 701, 2)] {
        let request = pb::StreamTrajectoryRequest { map: "a".into(), robot: name.into(), since_revision };
        let pieces = robot.stream_trajectory(request).await.unwrap().into_inner();
        let pieces: Vec<_> = pieces.map(Result::unwrap).collect().await;
        let found: Vec<u64> =
            pieces.iter().flat_map(|piece| &piece.poses).map(|pose| pose.revision).collect();
        assert_eq!(found, (first..=1300).step_by(step).collect::<Vec<_>>());
        assert!(pieces.iter().all(|piece| piece.poses.len() <= 512 && piece.version.is_some()));
    }
    let request =
        pb::StreamTrajectoryRequest { map: "a".into(), robot: "nobody".into(), ..Default::default() };
    let pieces = robot.stream_trajectory(request).await.unwrap().into_inner();
    let pieces: Vec<_> = pieces.map(Result::unwrap).collect().await;
    assert!(pieces.len() == 1 && pieces[0].poses.is_empty());

    // By HTTP: all, or a page.
    let all = poses(&daemon, "").await;
    assert_eq!(ids(&all), (1..=1300).collect::<Vec<_>>());
    assert_eq!((&all["revision"], &all["next_since_revision"]), (&json!(1300), &Value::Null));
    let page = poses(&daemon, "?robot=two&since_revision=10&limit=3").await;
    assert_eq!((ids(&page), &page["next_since_revision"]), (vec![11, 13, 15], &json!(15)));
    let last = poses(&daemon, "?since_revision=1290&limit=10").await;
    assert_eq!((ids(&last).len(), &last["next_since_revision"]), (10, &Value::Null));
    assert!(ids(&poses(&daemon, "?since_revision=18446744073709551615").await).is_empty());
    for bad in ["?limit=0", "?limit=101", "?limit=x", "?since=1"] {
        let refused = daemon.get(&format!("/v1/maps/a/trajectory{bad}")).await;
        assert_eq!(refused.status(), StatusCode::BAD_REQUEST, "{bad}");
    }
}

#[tokio::test]
async fn a_robot_more_than_there_may_be_is_refused_by_the_limits_name() {
    let daemon = Daemon::start_with(|config| config.limits.robots_per_map_max = 2).await;
    daemon.make_map("a").await;
    for (robot, id, status) in [
        ("one", 1, StatusCode::OK),
        ("two", 1, StatusCode::OK),
        ("three", 1, StatusCode::TOO_MANY_REQUESTS),
        ("two", 2, StatusCode::OK),
    ] {
        let answer = insert(&daemon, robot, id, 0.0).await;
        assert_eq!(answer.status(), status, "{robot} {id}");
        if status != StatusCode::OK {
            let error = json_of(answer).await;
            assert_eq!(error["reason"], "too_many_robots");
            assert!(error["detail"].as_str().unwrap().contains("robots_per_map_max is 2"), "{error}");
        }
    }
}
