//! What is no question, or is beyond a limit, is refused by name.

use super::{at, framed, row_of_voxels};

use serde_json::{Value, json};

use crate::support::daemon::{Daemon, json_of};

#[tokio::test]
async fn what_is_no_question_is_refused_by_name() {
    let (daemon, _, _) = row_of_voxels().await;
    let body = |radius: Value| json!({"links": [{"spheres": [[0, 0, 0, radius]]}]});
    let pose = [at(0.0, 0.0, 0.0)];
    for (route, asked, words) in [
        ("poses", json!({"body": body(json!(-1)), "configurations": pose}), "spheres[0]"),
        (
            "poses",
            json!({"body": body(json!(1)), "configurations": [[0, 0, 0, 0, 0, 0, 2]]}),
            "configurations[0]",
        ),
        ("poses", json!({"body": body(json!(1)), "configurations": []}), "configurations"),
        ("poses", json!({"body": {"links": []}, "configurations": pose}), "link"),
        (
            "poses",
            json!({"body": body(json!(1)), "configurations": pose, "clearance_max_m": 1}),
            "clearance_max_m",
        ),
        (
            "poses",
            json!({"body": body(json!(1)), "configurations": {"at": 0, "bytes": 28}}),
            "bytes after the head",
        ),
        (
            "motions",
            json!({"body": body(json!(1)), "configurations": pose, "lengths": [1]}),
            "motions have at least 2",
        ),
        (
            "motions",
            json!({"body": body(json!(0.1)), "configurations": [pose[0], pose[0]], "lengths": [2],
            "step_m": 0}),
            "step_m",
        ),
        ("rays", json!({"origins": [[0, 0, 0]], "directions": [[0, 0, 0]]}), "directions[0]"),
        ("rays", json!({"origins": [[0, 0, 0]], "directions": [[1, 0, 0]], "range_m": -1}), "range_m"),
        ("rays", json!({"origins": [[0, 0, 0]]}), "directions"),
        ("nearest", json!({"points": [[0, 0, 0]], "radius_m": 100}), "radius_m"),
        ("nearest", json!({"points": [[0, null, 0]], "radius_m": 1}), "points[0]"),
        (
            "rays",
            json!({"origins": [[0, 0, 0]], "directions": [[1, 0, 0]], "unknown": "maybe"}),
            "unknown: must be",
        ),
        ("classification", json!({"points": []}), "points"),
        ("classification", json!({"points": [[0, 0, 1e6]]}), "points[0]"),
        ("frontiers", json!({"box": {"min_m": [0, 0, 0], "max_m": [-1, 1, 1]}}), "min_m"),
        ("frontiers", json!({"box": {"min_m": [0, 0, 0], "max_m": [90, 90, 90]}}), "frontier_cells_max"),
        (
            "frontiers",
            json!({"box": {"min_m": [0, 0, 0], "max_m": [1, 1, 1]}, "frontiers_max": 1001}),
            "frontiers_max is 1001, limits.frontiers_max 1000",
        ),
        (
            "frontiers",
            json!({"box": {"min_m": [0, 0, 0], "max_m": [1, 1, 1]}, "standoff_m": 26}),
            "standoff_m must lie above 0 and at most 25.6",
        ),
        ("grid", json!({"cell_m": 0.15}), "cell_m"),
        ("grid", json!({"ignore_keep_outs": 1}), "ignore_keep_outs: must be true or false"),
        ("grid", json!({"area": {"min_m": [0, 0], "max_m": [1e5, 1e5]}, "cell_m": 0.1}), "grid_cells_max"),
        (
            "grid",
            json!({"area": {"min_m": [1e300, 0], "max_m": [1e300, 1]}}),
            "area.min_m must lie within -104857.6 m and 104857.6 m",
        ),
        ("poses", json!({"body": {"links": [{"points": []}]}, "configurations": pose}), "at least one point"),
        ("spheres", json!({"spheres": [[0, 0, 0, 1]], "sizes": [2]}), "sizes are of 2 spheres in all, got 1"),
        ("spheres", json!({"spheres": [[0, 0, 0, 1]], "level": 9}), "level"),
    ] {
        let answer = daemon.post(&format!("/v1/maps/a/{route}"), asked.clone()).await;
        assert!(answer.status().is_client_error(), "{route} {asked}: {}", answer.status());
        let said = json_of(answer).await;
        assert!(said["detail"].as_str().unwrap().contains(words), "{route} {asked}: {said}");
    }
    for short in [&[][..], &[9, 0, 0, 0, b'{'], &[255; 8]] {
        let answer = daemon.post_bytes("/v1/maps/a/rays", short.to_vec()).await;
        assert_eq!(json_of(answer).await["reason"], "bad_array");
    }
}

#[tokio::test]
async fn links_count_as_parts_of_a_body_and_groups_are_bounded_in_every_form() {
    use mrol::wire::pb;
    let daemon = Daemon::start_with(|config| config.limits.body_parts_max = 4).await;
    daemon.make_map("a").await;
    let words = "body has 5 links, spheres and points, body_parts_max is 4";
    for (links, is_taken) in [(3, true), (4, false)] {
        let pose: Vec<u8> = at(0.0, 0.0, 0.0).repeat(links).iter().flat_map(|c| c.to_le_bytes()).collect();
        // One sphere, so that it is somewhere.
        let mut json_links = vec![json!({}); links];
        json_links[0] = json!({"spheres": [[0, 0, 0, 0.1]]});
        let body = json!({"links": json_links});
        let mut pb_links = vec![pb::Link::default(); links];
        pb_links[0].spheres_f32le = [0f32, 0.0, 0.0, 0.1].map(f32::to_le_bytes).concat().into();
        for (route, rest) in [("poses", json!({})), ("motions", json!({"lengths": [2]}))] {
            let configurations = if route == "motions" { pose.repeat(2) } else { pose.clone() };
            let mut head = json!({"body": body, "configurations": {"at": 0, "bytes": configurations.len()}});
            head.as_object_mut().unwrap().extend(rest.as_object().unwrap().clone());
            let answer =
                daemon.post_bytes(&format!("/v1/maps/a/{route}"), framed(&head, &configurations)).await;
            assert_eq!(answer.status().is_success(), is_taken, "{route}");
            if !is_taken {
                let said = json_of(answer).await;
                assert!(said["detail"].as_str().unwrap().contains(words), "{route}: {said}");
            }
        }
        let request = pb::CheckPosesRequest {
            asked: Some(pb::Asked { map: "a".into(), ..Default::default() }),
            body: Some(pb::Body { links: pb_links }),
            configurations_f32le: pose.into(),
            ..Default::default()
        };
        let mut occupancy = daemon.occupancy().await;
        let told = occupancy.check_poses(request.clone()).await;
        assert_eq!(told.is_ok(), is_taken);
        let mut answers =
            occupancy.check_poses_stream(tokio_stream::iter([request])).await.unwrap().into_inner();
        let streamed = answers.message().await;
        assert_eq!(streamed.is_ok(), is_taken);
        for refused in [told.err(), streamed.err()].into_iter().flatten() {
            assert_eq!(refused.message(), words);
        }
    }
    let spheres = |sizes: Value| json!({"spheres": vec![[0, 0, 0, 1]; 5], "sizes": sizes});
    assert!(daemon.post("/v1/maps/a/spheres", spheres(json!([3, 2]))).await.status().is_success());
    let said = json_of(daemon.post("/v1/maps/a/spheres", spheres(json!([0, 5]))).await).await;
    assert_eq!(said["detail"], json!("sizes[1] has 5 spheres, body_parts_max is 4"));
}

#[tokio::test]
async fn a_head_in_the_form_for_programs_counts_as_json_does() {
    let daemon = Daemon::start_with(|config| {
        config.limits.message_bytes_max = 1 << 20;
        config.limits.body_bytes_max = 1 << 20;
    })
    .await;
    daemon.make_map("a").await;
    // An array behind the head takes what it is; JSON takes what is made of it too.
    for (blanks, array_bytes, is_taken) in [(0, 1 << 19, true), (100 << 10, 12, true), (200 << 10, 12, false)]
    {
        let slice = json!({"at": 0, "bytes": 12});
        let head = json!({"points": slice, "radius_m": 1}).to_string() + &" ".repeat(blanks);
        let length = (head.len() as u32).to_le_bytes();
        let request = [&length[..], head.as_bytes(), &vec![0; array_bytes]].concat();
        let answer = daemon.post_bytes("/v1/maps/a/nearest", request).await;
        assert_eq!(answer.status().is_success(), is_taken, "{blanks}");
        if !is_taken {
            let said = json_of(answer).await;
            assert!(said["detail"].as_str().unwrap().contains("body_bytes_max"), "{said}");
        }
    }
}

#[tokio::test]
async fn no_points_beside_spheres_are_none() {
    let (daemon, ..) = row_of_voxels().await;
    let body = json!({"links": [{"spheres": [[0, 0, 0, 0.1]], "points": []}]});
    let asked = json!({"body": body, "configurations": [at(0.55, 0.2, 0.05)]});
    let answer = daemon.post("/v1/maps/a/poses", asked).await;
    assert_eq!((answer.status().as_u16(), json_of(answer).await["checked"].as_u64()), (200, Some(1)));
}

#[tokio::test]
async fn lists_of_more_than_may_be_are_refused_before_they_are_read() {
    use mrol::wire::pb;
    let (daemon, ..) = row_of_voxels().await;
    let request = |ignored: usize, links: usize| pb::CheckPosesRequest {
        asked: Some(pb::Asked { map: "a".into(), ..Default::default() }),
        body: Some(pb::Body { links: vec![pb::Link::default(); links] }),
        ignored: vec![pb::Region::default(); ignored],
        ..Default::default()
    };
    for (request, words) in [
        (request(4097, 1), "ignored has more than 4096 entries in one message"),
        (request(0, 65_537), "body.links has more than 65536 entries in one message"),
    ] {
        let mut occupancy = daemon.occupancy().await;
        let told = occupancy.check_poses(request.clone()).await.unwrap_err();
        let mut answers =
            occupancy.check_poses_stream(tokio_stream::iter([request])).await.unwrap().into_inner();
        for refused in [told, answers.message().await.unwrap_err()] {
            assert_eq!(refused.message(), words);
            assert_eq!(refused.metadata().get("mrol-reason").unwrap(), "batch_too_large");
        }
    }
    let region = json!({"sphere": {"center_m": [0, 0, 0], "radius_m": 1}});
    let spheres = json!([[0, 0, 0, 1]]);
    for (asked, words) in [
        (json!({"spheres": spheres, "ignored": vec![region; 4097]}), "more than 4096 entries"),
        (json!({"spheres": spheres, "ignored": {}}), "an array of at most 4096 entries"),
    ] {
        let said = json_of(daemon.post("/v1/maps/a/spheres", asked).await).await;
        assert_eq!(said["reason"], "bad_json");
        assert!(said["detail"].as_str().unwrap().contains(words), "{said}");
    }
}
