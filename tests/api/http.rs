//! What the contract promises, over HTTP.

use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::support::daemon::{
    Daemon, bits_of, bytes_of, client, corner, identity_json, json_of, pose_json, row,
};
use crate::support::plain_set::content_hash;

fn reason(error: &Value) -> (&str, &str) {
    (error["code"].as_str().unwrap_or_default(), error["reason"].as_str().unwrap_or_default())
}

#[tokio::test]
async fn a_map_is_made_described_listed_and_deleted() {
    let daemon = Daemon::start().await;
    let settings = json!({"resolution_m": 0.05, "levels": 3});
    let made = daemon.put("/v1/maps/hall", settings.clone()).await;
    assert_eq!(made.status(), StatusCode::CREATED);
    let made = json_of(made).await;
    assert_eq!((&made["map"], &made["revision"]), (&json!("hall"), &json!(0)));
    assert_eq!(daemon.put("/v1/maps/hall", settings).await.status(), StatusCode::OK);
    let other = daemon.put("/v1/maps/hall", json!({"resolution_m": 0.1, "levels": 3})).await;
    assert_eq!(other.status(), StatusCode::CONFLICT);
    assert_eq!(reason(&json_of(other).await).0, "conflict");

    // Levels and filter are the server's where they are not said.
    assert_eq!(daemon.put("/v1/maps/atrium", json!({"resolution_m": 1})).await.status(), StatusCode::CREATED);
    let atrium = json_of(daemon.get("/v1/maps/atrium").await).await;
    assert_eq!(atrium["levels"].as_array().unwrap().len(), 6);
    assert_eq!(atrium["settings"]["filter"], made["settings"]["filter"]);
    assert_eq!(atrium["levels"][3]["resolution_m"], 8.0);

    let listed = json_of(daemon.get("/v1/maps").await).await;
    let names: Vec<_> = listed["maps"].as_array().unwrap().iter().map(|map| &map["map"]).collect();
    assert_eq!(names, ["atrium", "hall"]);
    assert_eq!(daemon.delete("/v1/maps/hall").await.status(), StatusCode::NO_CONTENT);
    let gone = daemon.get("/v1/maps/hall").await;
    assert_eq!(gone.status(), StatusCode::NOT_FOUND);
    let gone = json_of(gone).await;
    assert_eq!(reason(&gone).0, "not_found");
    assert!(gone["detail"].as_str().unwrap().contains("hall"), "{gone}");
}

#[tokio::test]
async fn a_scan_in_json_is_answered_in_full() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    // The first scan of a map goes in at its guess; null is "no return".
    let scan = json!({
        "robot": "r1", "scan_id": 7, "timestamp_ns": 5, "align": true, "guess": pose_json([1.0, 0.0, 0.0]),
        "points": [[0.05, 0.05, 0.05], [0.15, 0.05, 0.05], [null, 0.0, 0.0]],
    });
    let answer = json_of(daemon.post("/v1/maps/a/scans", scan.clone()).await).await;
    let uuid = answer["map_uuid"].clone();
    assert_eq!(uuid.as_str().unwrap().len(), 36);
    let hash = format!("{:016x}", content_hash(&[[10, 0, 0], [11, 0, 0]].into()));
    let expected = json!({
        "accepted": true, "verdict": "accepted", "reason": "the first scan of the map",
        "map_from_sensor": pose_json([1.0, 0.0, 0.0]), "overlap": 0.0, "level_overlaps": vec![0.0; 4],
        "inliers": 0.0, "fitness": 0.0, "information": vec![vec![0.0; 6]; 6], "undetermined": [], "rays": null, "rivals": [], "iterations": 0,
        "new_voxels": 2, "carved_voxels": 0, "points_skipped": 1, "replayed": false, "stationary": false, "recovered": null, "revision": 1,
        "map_uuid": uuid, "content_hash": hash,
    });
    assert!(answer["align_ms"].as_f64().unwrap() >= 0.0);
    let timeless = |mut answer: Value| {
        answer.as_object_mut().unwrap().remove("align_ms");
        answer
    };
    assert_eq!(timeless(answer), expected);
    let again = json_of(daemon.post("/v1/maps/a/scans", scan).await).await;
    assert_eq!((&again["replayed"], &again["revision"]), (&json!(true), &json!(1)));
    assert_eq!(again["content_hash"], hash);

    let trajectory = json_of(daemon.get("/v1/maps/a/trajectory?robot=r1").await).await;
    let pose = json!({
        "robot": "r1", "session": "", "scan_id": 7, "timestamp_ns": 5, "map_from_sensor": pose_json([1.0, 0.0, 0.0]),
        "revision": 1, "overlap": 0.0, "new_voxels": 2, "carved_voxels": 0,
    });
    assert_eq!(trajectory, json!({"poses": [pose], "revision": 1, "map_uuid": uuid, "content_hash": hash}));
    let nobody = json_of(daemon.get("/v1/maps/a/trajectory?robot=r2").await).await;
    assert_eq!(nobody["poses"], json!([]));
}

#[tokio::test]
async fn a_scan_in_bytes_means_the_same() {
    let daemon = Daemon::start().await;
    daemon.make_map("json").await;
    daemon.make_map("bytes").await;
    let scan = json!({"robot": "r", "scan_id": 1, "points": row(50), "guess": pose_json([0.5, 0.0, 0.0]), "align": false});
    let json = json_of(daemon.post("/v1/maps/json/scans", scan).await).await;
    let route = "/v1/maps/bytes/scans?robot=r&scan_id=1&align=false&guess=0.5,0,0,0,0,0,1";
    let bytes = json_of(daemon.post_bytes(route, bytes_of(&row(50))).await).await;
    assert_eq!((&bytes["accepted"], &bytes["new_voxels"]), (&json!(true), &json!(50)));
    assert_eq!(bytes["map_from_sensor"], json["map_from_sensor"]);
    assert_eq!(daemon.contents("bytes").await, daemon.contents("json").await);
}

#[tokio::test]
async fn odometry_moves_the_guess_on_from_the_last_pose() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(20)).await;
    let moved =
        json!({"robot": "setup", "points": row(20), "motion": pose_json([0.5, 0.0, 0.0]), "align": false});
    let answer = json_of(daemon.post("/v1/maps/a/scans", moved).await).await;
    assert_eq!(answer["map_from_sensor"], pose_json([0.5, 0.0, 0.0]));
    assert_eq!(answer["new_voxels"], 5);
    let route = "/v1/maps/a/scans?robot=setup&align=false&motion=0.1,0,0,0,0,0,1";
    let answer = json_of(daemon.post_bytes(route, bytes_of(&row(20))).await).await;
    assert_eq!(answer["map_from_sensor"]["translation_m"][0], 0.6);
}

#[tokio::test]
async fn an_alignment_changes_nothing_and_a_scan_that_does_not_fit_is_an_answer() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &corner()).await;
    let before = daemon.contents("a").await;
    let near = json!({"robot": "r", "points": corner(), "guess": identity_json()});
    let aligned = json_of(daemon.post("/v1/maps/a/alignment", near).await).await;
    assert_eq!((&aligned["accepted"], &aligned["verdict"]), (&json!(true), &json!("accepted")));
    let far = json!({"robot": "r", "points": corner(), "guess": pose_json([500.0, 0.0, 0.0])});
    for route in ["alignment", "scans"] {
        let answer = daemon.post(&format!("/v1/maps/a/{route}"), far.clone()).await;
        assert_eq!(answer.status(), StatusCode::OK);
        let answer = json_of(answer).await;
        assert_eq!((&answer["accepted"], &answer["verdict"]), (&json!(false), &json!("low_overlap")));
        assert_eq!(answer["revision"], 1);
    }
    assert_eq!(daemon.contents("a").await, before);
}

#[tokio::test]
async fn errors_of_state_have_statuses_of_their_own() {
    let daemon = Daemon::start_with(|config| config.limits.min_revision_wait_max_s = 0.1).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(20)).await;
    let scan = |id: u64, points: usize| json!({"robot": "r", "scan_id": id, "points": row(points), "guess": identity_json(), "align": false});
    assert_eq!(daemon.post("/v1/maps/a/scans", scan(1, 21)).await.status(), StatusCode::OK);
    let cases = [
        (daemon.post("/v1/maps/a/scans", scan(1, 19)).await, 409, "conflict"),
        (
            daemon.post("/v1/maps/a/scans", json!({"robot": "new", "points": row(20)})).await,
            412,
            "failed_precondition",
        ),
        (
            daemon.post("/v1/maps/a/occupancy", json!({"points": row(1), "min_revision": 99})).await,
            504,
            "deadline_exceeded",
        ),
        (
            daemon.post("/v1/maps/a/occupancy", json!({"points": row(1), "map_uuid": "0".repeat(32)})).await,
            412,
            "failed_precondition",
        ),
        (daemon.get("/v1/map").await, 404, "not_found"),
        (daemon.post("/v1/maps", json!({})).await, 405, "invalid_argument"),
        (daemon.delete("/metrics").await, 405, "invalid_argument"),
    ];
    for (answer, status, code) in cases {
        assert_eq!(answer.status().as_u16(), status);
        let error = json_of(answer).await;
        assert_eq!(reason(&error).0, code, "{error}");
        assert!(!reason(&error).1.is_empty() && error["detail"].is_string(), "{error}");
    }
}

#[tokio::test]
async fn occupancy_is_told_in_json_or_as_a_bitmap() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let put = daemon.put_in("a", &row(3)).await;
    let question = json!({"points": row(10), "level": 0, "lookup": "exact"});
    let answer = json_of(daemon.post("/v1/maps/a/occupancy", question).await).await;
    let expected: Vec<bool> = (0..10).map(|i| i < 3).collect();
    let whole = json!({
        "occupied": expected, "points_occupied": 3, "revision": 1, "map_uuid": put["map_uuid"],
        "content_hash": put["content_hash"],
    });
    assert_eq!(answer, whole);

    for (parameters, occupied) in [
        ("", 0b111),
        ("?level=1", 0b1111),
        ("?lookup=exact&min_revision=1", 0b111),
        ("?pose=-0.5,0,0,0,0,0,1", 0b1110_0000),
    ] {
        let answer =
            daemon.post_bytes(&format!("/v1/maps/a/occupancy{parameters}"), bytes_of(&row(10))).await;
        assert_eq!(answer.status(), StatusCode::OK);
        let header = |name: &str| answer.headers()[name].to_str().unwrap().to_owned();
        assert_eq!(header("content-type"), "application/octet-stream");
        assert_eq!([header("mrol-revision"), header("mrol-points")], ["1", "10"]);
        assert_eq!(header("mrol-map-uuid"), put["map_uuid"].as_str().unwrap());
        assert_eq!(header("mrol-content-hash"), put["content_hash"].as_str().unwrap());
        assert_eq!(answer.bytes().await.unwrap()[..], [occupied, 0], "{parameters}");
    }
    let bloom = daemon.post_bytes("/v1/maps/a/occupancy?lookup=bloom", bytes_of(&row(10))).await;
    assert!(bits_of(&bloom.bytes().await.unwrap(), 10)[..3].iter().all(|&bit| bit));
    let moved = json!({"points": row(10), "map_from_points": pose_json([-0.5, 0.0, 0.0])});
    let moved = json_of(daemon.post("/v1/maps/a/occupancy", moved).await).await;
    assert_eq!((&moved["occupied"][4], &moved["occupied"][5]), (&json!(false), &json!(true)));
}

#[tokio::test]
async fn large_bodies_are_answered_like_small_ones() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let points = row(20_000);
    assert_eq!(daemon.put_in("a", &points).await["new_voxels"], 20_000);
    let json = json_of(daemon.post("/v1/maps/a/occupancy", json!({"points": points})).await).await;
    assert_eq!(json["points_occupied"], 20_000);
    let bitmap = daemon.post_bytes("/v1/maps/a/occupancy", bytes_of(&points)).await;
    assert!(bitmap.bytes().await.unwrap().iter().all(|&byte| byte == 0xff));
}

#[tokio::test]
async fn voxels_are_deleted_by_points_voxels_box_and_sphere() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(40)).await;
    let cases = [
        (json!({"points": [row(1)[0], row(2)[1]]}), 2),
        (json!({"voxels": [[1, 0, 0], [2, 0, 0]], "level": 1}), 4),
        (json!({"box": {"min_m": [1.0, 0.0, 0.0], "max_m": [1.5, 0.1, 0.1]}}), 5),
        (json!({"sphere": {"center_m": [2.05, 0.05, 0.05], "radius_m": 0.12}}), 3),
        (json!({"sphere": {"center_m": [2.05, 0.05, 0.05], "radius_m": 0.12}}), 0),
    ];
    let (mut left, mut revision) = (40, 1);
    for (deletion, removed) in cases {
        let answer = json_of(daemon.post("/v1/maps/a/deletions", deletion.clone()).await).await;
        left -= removed;
        revision += u64::from(removed > 0);
        assert_eq!(
            (&answer["removed"], &answer["revision"]),
            (&json!(removed), &json!(revision)),
            "{deletion}"
        );
        assert_eq!(daemon.contents("a").await.1.len(), left);
    }
    let bytes = daemon.post_bytes("/v1/maps/a/deletions?level=3", bytes_of(&[[3.5, 0.0, 0.0]])).await;
    assert_eq!(json_of(bytes).await["removed"], 8);
}

#[tokio::test]
async fn voxels_are_listed_by_level_and_box() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let put = daemon.put_in("a", &row(10)).await;
    let coarse = json_of(daemon.get("/v1/maps/a/voxels?level=2").await).await;
    let whole = json!({
        "level": 2, "resolution_m": 0.4, "revision": 1, "map_uuid": put["map_uuid"],
        "content_hash": put["content_hash"], "voxels_total": 3,
        "voxels": [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
    });
    assert_eq!(coarse, whole);
    let part = json_of(daemon.get("/v1/maps/a/voxels?min=0.2,0,0&max=0.5,1,1").await).await;
    assert_eq!(part["voxels"], json!([[2, 0, 0], [3, 0, 0], [4, 0, 0]]));
    let half = daemon.get("/v1/maps/a/voxels?min=0,0,0").await;
    assert_eq!(half.status(), StatusCode::BAD_REQUEST);
}

#[tokio::test]
async fn a_read_waits_for_its_revision() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let question = json!({"points": row(2), "min_revision": 1});
    let points = row(1);
    let (answer, _) =
        tokio::join!(daemon.post("/v1/maps/a/occupancy", question), daemon.put_in("a", &points));
    assert_eq!(json_of(answer).await["occupied"], json!([true, false]));
}

#[tokio::test]
async fn an_answer_carries_the_id_of_its_request() {
    let daemon = Daemon::start().await;
    let own = client().get(daemon.url("/v1/maps")).header("x-request-id", "mine").send().await.unwrap();
    assert_eq!(own.headers()["x-request-id"], "mine");
    let given = daemon.get("/v1/maps").await;
    assert!(given.headers()["x-request-id"].len() > 8);
}

#[tokio::test]
async fn a_map_goes_out_as_a_file_and_comes_back_under_another_name() {
    let daemon = Daemon::start_with(|config| config.limits.map_file_bytes_max = 100_000).await;
    daemon.make_map("hall").await;
    daemon.put_in("hall", &[[1.05, 2.05, 3.05], [-4.05, 0.05, 0.05]]).await;
    let taken = daemon.get("/v1/maps/hall/snapshot").await;
    let header = |name: &str| taken.headers().get(name).unwrap().to_str().unwrap().to_owned();
    assert_eq!(header("content-disposition"), "attachment; filename=\"hall.mrol\"");
    assert_eq!(
        (header("content-type").as_str(), header("mrol-revision").as_str()),
        ("application/octet-stream", "1")
    );
    let file = taken.bytes().await.unwrap();

    let put = async |path: &str, body: Vec<u8>| {
        let request =
            client().put(daemon.url(path)).header("content-type", "application/octet-stream").body(body);
        let answer = request.send().await.unwrap();
        (answer.status(), json_of(answer).await)
    };
    let (status, made) = put("/v1/maps/copy/snapshot", file.to_vec()).await;
    assert_eq!((status, &made["map"]), (StatusCode::CREATED, &json!("copy")));
    assert_eq!(daemon.contents("copy").await, daemon.contents("hall").await);

    let (status, error) = put("/v1/maps/copy/snapshot", file.to_vec()).await;
    assert_eq!((status, reason(&error).0), (StatusCode::CONFLICT, "conflict"));
    let (status, error) = put("/v1/maps/other/snapshot", file[..file.len() - 1].to_vec()).await;
    assert_eq!((status, reason(&error).0), (StatusCode::BAD_REQUEST, "invalid_argument"));
    let (status, error) = put("/v1/maps/other/snapshot", vec![0; 100_001]).await;
    assert_eq!((status, reason(&error).1), (StatusCode::PAYLOAD_TOO_LARGE, "body_too_large"));
    assert!(error["detail"].as_str().unwrap().contains("100000 bytes (map_file_bytes_max)"), "{error}");
    assert_eq!(daemon.get("/v1/maps/other").await.status(), StatusCode::NOT_FOUND);
}
