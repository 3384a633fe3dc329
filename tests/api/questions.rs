//! Questions of planners: the same answers over gRPC, over HTTP in both forms, and from a replica.

use std::sync::Arc;

use mrol::client::{Client, Replica, ReplicaOptions};
use mrol::geometry::Point;
use mrol::map::{KeepOutName, KeepOutShape, MapName, Region};
use mrol::planning::{
    Body, Frontiers, GridArea, Link, MeasuredTo, Met, PointState, Sphere, Surroundings, Unknown,
};
use mrol::service::{
    Asked, CheckAs, ClassifyQuestion, Collisions, FrontierQuestion, GridQuestion, GridScope, MotionCheck,
    NearestQuestion, PoseCheck, PutKeepOut, Question, RayQuestion, RaysToward, SphereCheck,
};
use mrol::voxel::VoxelKey;
use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::support::daemon::{Daemon, json_of, row};

fn map() -> MapName {
    MapName::new("a").unwrap()
}

/// A server with a row of twenty voxels of 0.1 m along x, a client of it, and a replica.
async fn row_of_voxels() -> (Daemon, Client, Replica) {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(20)).await;
    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    let replica = Replica::open(client.clone(), map(), ReplicaOptions::default()).await.unwrap();
    (daemon, client, replica)
}

fn ball(radius_m: f32) -> Arc<Body> {
    let spheres = vec![Sphere { center_m: [0.0; 3], radius_m }];
    Arc::new(Body::new(vec![Link { spheres, ..Link::default() }]).unwrap())
}

fn at(x: f32, y: f32, z: f32) -> [f32; 7] {
    [x, y, z, 0.0, 0.0, 0.0, 1.0]
}

fn poses(answer: CheckAs) -> PoseCheck {
    let configurations = [at(0.55, 0.4, 0.05), at(0.55, 0.2, 0.05), at(-5.0, 0.0, 0.0)].concat();
    let (asked, surroundings) = (Asked::default(), Surroundings::default());
    PoseCheck { asked, body: ball(0.15), configurations, surroundings, answer }
}

/// Bodies of requests in the form for programs.
fn framed(head: &Value, arrays: &[u8]) -> Vec<u8> {
    let head = serde_json::to_vec(head).unwrap();
    [&(head.len() as u32).to_le_bytes()[..], &head, arrays].concat()
}

/// The head and the arrays of an answer in the form for programs.
fn parts(body: &[u8]) -> (Value, &[u8]) {
    let length = u32::from_le_bytes(body[..4].try_into().unwrap()) as usize;
    (serde_json::from_slice(&body[4..4 + length]).unwrap(), &body[4 + length..])
}

fn array<'a>(head: &Value, arrays: &'a [u8], name: &str) -> &'a [u8] {
    let [at, bytes] = ["at", "bytes"].map(|field| head[name][field].as_u64().unwrap() as usize);
    &arrays[at..at + bytes]
}

fn same<Q: Question>(replica: &Replica, question: &Q, told: &mrol::service::Answered<Q::Answer>)
where
    Q::Answer: PartialEq,
{
    let own = replica.ask(question).unwrap();
    assert_eq!((&own.answer, own.version), (&told.answer, told.version));
}

#[tokio::test]
async fn poses_are_checked_alike_everywhere() {
    let (daemon, client, replica) = row_of_voxels().await;
    for answer in [CheckAs::Colliding, CheckAs::FirstHit, CheckAs::Clearance { most_m: Some(1.0) }] {
        let told = client.check_poses(&map(), poses(answer)).await.unwrap();
        assert_eq!(told.answer.words(), [0b010]);
        same(&replica, &poses(answer), &told);
        if let Collisions::Clearances(clearances) = &told.answer {
            // From the ball's surface to the row's, at y = 0.1.
            assert!((clearances[0].distance_m - 0.15).abs() < 1e-6, "{clearances:?}");
            assert_eq!((clearances[0].link, clearances[2].link), (Some(0), None));
        }
    }
    let body = json!({"links": [{"spheres": [[0, 0, 0, 0.15]]}]});
    let listed = [at(0.55, 0.4, 0.05), at(0.55, 0.2, 0.05), at(-5.0, 0.0, 0.0)];
    let asked = json!({"body": body, "configurations": listed, "answer": "first_hit"});
    let told = json_of(daemon.post("/v1/maps/a/poses", asked).await).await;
    assert_eq!((&told["colliding"], &told["checked"]), (&json!([false, true, false]), &json!(3)));
    assert_eq!((&told["hit_voxels"][0], &told["hit_voxels"][1]), (&Value::Null, &json!([5, 0, 0])));
    assert_eq!((&told["hit_links"], &told["revision"]), (&json!([null, 0, null]), &json!(1)));

    let bytes: Vec<u8> = listed.concat().iter().flat_map(|number| number.to_le_bytes()).collect();
    let head = json!({"body": body, "configurations": {"at": 0, "bytes": bytes.len()}, "answer": "clearance",
        "clearance_max_m": 1.0});
    let answer = daemon.post_bytes("/v1/maps/a/poses", framed(&head, &bytes)).await;
    assert_eq!(answer.status(), StatusCode::OK);
    let answer = answer.bytes().await.unwrap();
    let (head, arrays) = parts(&answer);
    assert_eq!(array(&head, arrays, "colliding"), [0b010]);
    let clearance = f32::from_le_bytes(array(&head, arrays, "clearances_m")[..4].try_into().unwrap());
    assert!((clearance - 0.15).abs() < 1e-6);
}

#[tokio::test]
async fn what_is_ignored_does_not_collide() {
    let (daemon, client, _) = row_of_voxels().await;
    let ignored = vec![Region::cuboid([0.0; 3], [1.0; 3]).unwrap()];
    let check = PoseCheck {
        surroundings: Surroundings { ignored, ..Surroundings::ALL_VOXELS },
        ..poses(CheckAs::Colliding)
    };
    assert_eq!(client.check_poses(&map(), check).await.unwrap().answer.words(), [0]);
    let body = json!({"links": [{"spheres": [[0, 0, 0, 0.15]]}]});
    let asked = json!({"body": body, "configurations": [at(0.55, 0.2, 0.05)],
        "ignored": [{"box": {"min_m": [0, 0, 0], "max_m": [1, 1, 1]}}]});
    let told = json_of(daemon.post("/v1/maps/a/poses", asked).await).await;
    assert_eq!(told["colliding"], json!([false]), "{told}");
}

#[tokio::test]
async fn spheres_are_checked_group_by_group() {
    let (daemon, client, replica) = row_of_voxels().await;
    let sphere = |y: f32| Sphere { center_m: [0.55, y, 0.05], radius_m: 0.1 };
    let check = SphereCheck {
        asked: Asked::default(),
        spheres: vec![sphere(0.5), sphere(0.15), sphere(0.4)],
        sizes: vec![2, 1],
        padding_m: 0.0,
        surroundings: Surroundings::default(),
        answer: CheckAs::Colliding,
    };
    let told = client.check_spheres(&map(), check.clone()).await.unwrap();
    assert_eq!((told.answer.words(), told.answer.checked()), (vec![0b01], 2));
    same(&replica, &check, &told);
    let asked = json!({"spheres": [[0.55, 0.5, 0.05, 0.1], [0.55, 0.15, 0.05, 0.1], [0.55, 0.4, 0.05, 0.1]]});
    let told = json_of(daemon.post("/v1/maps/a/spheres", asked).await).await;
    assert_eq!(told["colliding"], json!([false, true, false]), "{told}");
}

#[tokio::test]
async fn motions_are_checked_alike_everywhere() {
    let (daemon, client, replica) = row_of_voxels().await;
    let check = MotionCheck {
        asked: Asked::default(),
        body: ball(0.1),
        configurations: [at(1.0, 1.05, 0.05), at(1.0, -0.95, 0.05), at(0.0, 1.0, 0.0), at(2.0, 1.0, 0.0)]
            .concat(),
        lengths: vec![2, 2],
        step_m: None,
        clearance_max_m: Some(2.0),
        surroundings: Surroundings::default(),
    };
    let told = client.check_motions(&map(), check.clone()).await.unwrap();
    same(&replica, &check, &told);
    let [through, beside] = told.answer[..] else { panic!("{told:?}") };
    assert!(!through.is_free() && beside.is_free());
    // The ball's center comes within 0.1 m of y = 0.1 at y = 0.2: after 0.85 of 2 m.
    assert!((through.first_hit.unwrap() - 0.425).abs() < 0.03, "{through:?}");
    assert!((beside.clearance_m.unwrap() - 0.8).abs() < 1e-5, "{beside:?}");
    let body = json!({"links": [{"spheres": [[0, 0, 0, 0.1]]}]});
    let configurations = [at(1.0, 1.05, 0.05), at(1.0, -0.95, 0.05), at(0.0, 1.0, 0.0), at(2.0, 1.0, 0.0)];
    let asked = json!({"body": body, "configurations": configurations, "lengths": [2, 2]});
    let told = json_of(daemon.post("/v1/maps/a/motions", asked).await).await;
    assert_eq!((&told["free"], &told["free_count"]), (&json!([false, true]), &json!(1)), "{told}");
}

#[tokio::test]
async fn rays_are_cast_alike_everywhere() {
    let (daemon, client, replica) = row_of_voxels().await;
    let points = |of: &[[f32; 3]]| of.iter().copied().map(Point::from).collect::<Vec<_>>().into();
    let question = RayQuestion {
        asked: Asked::default(),
        origins: points(&[[-1.0, 0.05, 0.05]]),
        toward: RaysToward::Directions {
            directions: points(&[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]),
            range_m: f64::INFINITY,
        },
        unknown: Unknown::Free,
    };
    let told = client.cast_rays(&map(), question.clone()).await.unwrap();
    assert_eq!((told.answer.hits(), told.answer.voxels[0].index()), (1, [0, 0, 0]));
    assert!((told.answer.distances_m[0] - 1.0).abs() < 1e-6);
    same(&replica, &question, &told);
    let asked = json!({"origins": [[-1, 0.05, 0.05]], "directions": [[1, 0, 0], [-1, 0, 0]]});
    let told = json_of(daemon.post("/v1/maps/a/rays", asked).await).await;
    assert_eq!((&told["hit"], &told["voxels"]), (&json!([true, false]), &json!([[0, 0, 0], null])), "{told}");
    assert_eq!(told["distances_m"][1], Value::Null);
}

#[tokio::test]
async fn nearest_voxels_are_found_alike_everywhere() {
    let (daemon, client, replica) = row_of_voxels().await;
    let question = NearestQuestion {
        asked: Asked::default(),
        points: vec![Point::new(0.55, 0.3, 0.05), Point::new(9.0, 9.0, 9.0)].into(),
        radius_m: 1.0,
        to: MeasuredTo::Cubes,
    };
    let told = client.find_nearest(&map(), question.clone()).await.unwrap();
    assert_eq!((told.answer.found.clone(), told.answer.voxels[0].index()), (vec![0b01], [5, 0, 0]));
    assert!((told.answer.distances_m[0] - 0.2).abs() < 1e-6 && told.answer.away[0] == [0.0, 1.0, 0.0]);
    same(&replica, &question, &told);
    let asked = json!({"points": [[0.55, 0.3, 0.05]], "radius_m": 1.0, "to": "centers"});
    let told = json_of(daemon.post("/v1/maps/a/nearest", asked).await).await;
    assert!((told["distances_m"][0].as_f64().unwrap() - 0.25).abs() < 1e-6, "{told}");
}

#[tokio::test]
async fn the_map_is_drawn_from_above_alike_everywhere() {
    let (daemon, client, replica) = row_of_voxels().await;
    let area = GridArea::Rectangle { min_m: [0.0, -0.1], max_m: [0.4, 0.2] };
    let scope = GridScope { area, band_m: [0.0, 1.0], cell_m: Some(0.2), tells_unknown: false };
    let question = GridQuestion { asked: Asked::default(), scope };
    let told = client.project_grid(&map(), question).await.unwrap();
    // Cells begin at whole multiples of their side: y from -0.2 on.
    assert_eq!((told.answer.size, told.answer.occupied.clone()), ([2, 2], vec![0b1100]));
    let own = replica.ask(&question).unwrap();
    assert_eq!((own.answer.size, own.answer.occupied), (told.answer.size, told.answer.occupied));
    let asked = json!({"area": {"min_m": [0, -0.1], "max_m": [0.4, 0.2]}, "cell_m": 0.2});
    let told = json_of(daemon.post("/v1/maps/a/grid", asked).await).await;
    assert_eq!(
        (&told["size"], &told["occupied"]),
        (&json!([2, 2]), &json!([false, false, true, true])),
        "{told}"
    );
    assert_eq!(told["tops_m"][0], Value::Null);
}

#[tokio::test]
async fn points_that_nobody_saw_are_unknown_everywhere() {
    let (daemon, client, replica) = row_of_voxels().await;
    let points: Vec<Point> = [[0.55, 0.05, 0.05], [0.55, 0.35, 0.05]].map(Point::from).to_vec();
    let question = ClassifyQuestion { asked: Asked::default(), points: points.clone().into() };
    let told = client.classify_points(&map(), question.clone()).await.unwrap();
    assert_eq!([0, 1].map(|i| told.answer.state(i)), [PointState::Occupied, PointState::Unknown]);
    same(&replica, &question, &told);
    let mut streamed =
        client.classification_stream(&map(), tokio_stream::iter([question.clone(), question])).await.unwrap();
    for _ in 0..2 {
        assert_eq!(streamed.next().await.unwrap().unwrap(), told);
    }
    let asked = json!({"points": [[0.55, 0.05, 0.05], [0.55, 0.35, 0.05]]});
    let told = json_of(daemon.post("/v1/maps/a/classification", asked).await).await;
    assert_eq!((&told["occupied"], &told["free"]), (&json!([true, false]), &json!([false, false])), "{told}");
    assert_eq!(
        (&told["points_occupied"], &told["points_free"], &told["points"]),
        (&json!(1), &json!(0), &json!(2))
    );
    let bytes: Vec<u8> = points.iter().flat_map(|point| point.xyz()).flat_map(f32::to_le_bytes).collect();
    let head = json!({"points": {"at": 0, "bytes": bytes.len()}});
    let answer =
        daemon.post_bytes("/v1/maps/a/classification", framed(&head, &bytes)).await.bytes().await.unwrap();
    let (head, arrays) = parts(&answer);
    assert_eq!((array(&head, arrays, "occupied"), array(&head, arrays, "free")), (&[0b01][..], &[0b00][..]));
}

#[tokio::test]
async fn what_nobody_saw_is_met_where_it_counts_as_occupied() {
    let (daemon, client, replica) = row_of_voxels().await;
    let surroundings = Surroundings { unknown: Unknown::Occupied, ..Surroundings::ALL_VOXELS };
    let check = PoseCheck { surroundings: surroundings.clone(), ..poses(CheckAs::FirstHit) };
    let told = client.check_poses(&map(), check.clone()).await.unwrap();
    assert_eq!(told.answer.words(), [0b111]);
    same(&replica, &check, &told);
    let configurations = vec![at(0.55, 0.4, 0.05), at(0.55, 0.6, 0.05)];
    let motion = MotionCheck {
        asked: Asked::default(),
        body: ball(0.1),
        configurations: configurations.concat(),
        lengths: vec![2],
        step_m: None,
        clearance_max_m: None,
        surroundings: surroundings.clone(),
    };
    let told = client.check_motions(&map(), motion.clone()).await.unwrap();
    assert_eq!(told.answer[0].first_hit, Some(0.0));
    same(&replica, &motion, &told);
    let spheres = SphereCheck {
        asked: Asked::default(),
        spheres: vec![Sphere { center_m: [0.55, 0.5, 0.05], radius_m: 0.1 }],
        sizes: vec![1],
        padding_m: 0.0,
        surroundings,
        answer: CheckAs::Colliding,
    };
    let told = client.check_spheres(&map(), spheres.clone()).await.unwrap();
    assert_eq!(told.answer.words(), [1]);
    same(&replica, &spheres, &told);
    let points = |of: &[[f32; 3]]| of.iter().copied().map(Point::from).collect::<Vec<_>>().into();
    let rays = RayQuestion {
        asked: Asked::default(),
        origins: points(&[[0.55, 0.45, 0.05]]),
        toward: RaysToward::Directions { directions: points(&[[0.0, 1.0, 0.0]]), range_m: f64::INFINITY },
        unknown: Unknown::Occupied,
    };
    let told = client.cast_rays(&map(), rays.clone()).await.unwrap();
    assert_eq!(
        (told.answer.hits(), told.answer.distances_m[0], told.answer.voxels[0].index()),
        (1, 0.0, [5, 4, 0])
    );
    same(&replica, &rays, &told);

    let body = json!({"links": [{"spheres": [[0, 0, 0, 0.1]]}]});
    for (route, asked, array, met) in [
        ("poses", json!({"body": body, "configurations": [configurations[0]]}), "colliding", true),
        ("motions", json!({"body": body, "configurations": configurations, "lengths": [2]}), "free", false),
        ("spheres", json!({"spheres": [[0.55, 0.5, 0.05, 0.1]]}), "colliding", true),
        ("rays", json!({"origins": [[0.55, 0.45, 0.05]], "directions": [[0, 1, 0]]}), "hit", true),
    ] {
        for (word, expected) in [("occupied", met), ("free", !met)] {
            let mut asked = asked.clone();
            asked["unknown"] = json!(word);
            let told = json_of(daemon.post(&format!("/v1/maps/a/{route}"), asked).await).await;
            assert_eq!(told[array], json!([expected]), "{route} {word}: {told}");
        }
    }
}

#[tokio::test]
async fn a_map_that_nobody_saw_has_no_frontier_and_no_free_cell() {
    let (daemon, client, replica) = row_of_voxels().await;
    let question = FrontierQuestion {
        asked: Asked::default(),
        min_m: [-1.0; 3],
        max_m: [1.0; 3],
        size_min: Some(1),
        frontiers_max: None,
        standoff_m: Some(0.5),
    };
    let told = client.list_frontiers(&map(), question).await.unwrap();
    assert_eq!(told.answer, Frontiers::default());
    same(&replica, &question, &told);
    let asked = json!({"box": {"min_m": [-1, -1, -1], "max_m": [1, 1, 1]}});
    let told = json_of(daemon.post("/v1/maps/a/frontiers", asked).await).await;
    assert_eq!(
        (&told["frontiers"], &told["frontiers_total"], &told["revision"]),
        (&json!([]), &json!(0), &json!(1))
    );

    let area = GridArea::Rectangle { min_m: [0.0, -0.1], max_m: [0.4, 0.2] };
    let scope = GridScope { area, band_m: [0.0, 1.0], cell_m: Some(0.2), tells_unknown: true };
    let question = GridQuestion { asked: Asked::default(), scope };
    let told = client.project_grid(&map(), question).await.unwrap();
    assert_eq!(
        (0..4).map(|cell| told.answer.is_unknown(cell)).collect::<Vec<_>>(),
        [true, true, false, false]
    );
    assert_eq!(replica.ask(&question).unwrap().answer.free, told.answer.free);
    let asked =
        json!({"area": {"min_m": [0, -0.1], "max_m": [0.4, 0.2]}, "cell_m": 0.2, "tell_unknown": true});
    let told = json_of(daemon.post("/v1/maps/a/grid", asked).await).await;
    assert_eq!(
        (&told["free"], &told["cells_free"]),
        (&json!([false, false, false, false]), &json!(0)),
        "{told}"
    );
}

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
    let kept = daemon.metric("mrol_body_bytes").await.unwrap();
    assert!(kept > 0.0 && kept < 1024.0, "{kept}");
}

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
        ("spheres", json!({"spheres": [[0, 0, 0, 1]], "sizes": [2]}), "groups"),
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
    let daemon = Daemon::start_with(|config| config.limits.body_parts_max = 3).await;
    daemon.make_map("a").await;
    let words = "body has 4 links, spheres and points, body_parts_max is 3";
    for (links, is_taken) in [(3, true), (4, false)] {
        let pose: Vec<u8> = at(0.0, 0.0, 0.0).repeat(links).iter().flat_map(|c| c.to_le_bytes()).collect();
        let body = json!({"links": vec![json!({}); links]});
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
            body: Some(pb::Body { links: vec![pb::Link::default(); links] }),
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
    let said = json_of(daemon.post("/v1/maps/a/spheres", spheres(json!([1, 4]))).await).await;
    assert_eq!(said["detail"], json!("sizes[1] has 4 spheres, body_parts_max is 3"));
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

/// A server with the row, and a crate: a box from y = 1 to 2 along all of the row.
async fn row_and_crate() -> (Daemon, Client, Replica) {
    let (daemon, client, replica) = row_of_voxels().await;
    let shape = KeepOutShape::of_region(Region::cuboid([0.0, 1.0, 0.0], [2.0, 2.0, 0.5]).unwrap()).unwrap();
    let name = KeepOutName::new("crate").unwrap();
    let put = PutKeepOut { name, shape, expires_at_ns: None, request_id: None };
    let revision = client.put_keep_out(&map(), put).await.unwrap().version.revision;
    replica.wait_for_revision(revision, std::time::Duration::from_secs(20)).await.unwrap();
    (daemon, client, replica)
}

/// The same question without keep-outs.
fn but_keep_outs() -> Asked {
    Asked { ignore_keep_outs: true, ..Asked::default() }
}

#[tokio::test]
async fn keep_outs_count_for_bodies_unless_they_are_ignored() {
    let (daemon, client, replica) = row_and_crate().await;
    let configurations = [at(0.55, 0.2, 0.05), at(0.55, 0.9, 0.05), at(0.55, 0.5, 0.05)].concat();
    let check = |answer| PoseCheck { configurations: configurations.clone(), ..poses(answer) };
    let hits = client.check_poses(&map(), check(CheckAs::FirstHit)).await.unwrap();
    same(&replica, &check(CheckAs::FirstHit), &hits);
    let Collisions::FirstHits(of) = &hits.answer else { panic!("{hits:?}") };
    let met: Vec<_> = of.iter().map(|hit| hit.as_ref().map(|hit| hit.met.clone())).collect();
    let voxel = VoxelKey::new([5, 0, 0]).unwrap();
    let name = KeepOutName::new("crate").unwrap();
    assert_eq!(met, [Some(Met::Voxel(voxel)), Some(Met::KeepOut(name)), None]);
    let room = client.check_poses(&map(), check(CheckAs::Clearance { most_m: Some(1.0) })).await.unwrap();
    same(&replica, &check(CheckAs::Clearance { most_m: Some(1.0) }), &room);
    let Collisions::Clearances(clearances) = &room.answer else { panic!("{room:?}") };
    assert!((clearances[2].distance_m - 0.25).abs() < 1e-6 && clearances[1].distance_m == 0.0, "{room:?}");
    let ignoring = PoseCheck { asked: but_keep_outs(), ..check(CheckAs::Colliding) };
    assert_eq!(client.check_poses(&map(), ignoring.clone()).await.unwrap().answer.words(), [0b001]);
    assert_eq!(replica.ask(&ignoring).unwrap().answer.words(), [0b001]);
    // A region of voxels that do not count has no say in keep-outs.
    let ignored = vec![Region::cuboid([-9.0; 3], [9.0; 3]).unwrap()];
    let regions = PoseCheck {
        surroundings: Surroundings { ignored, ..Surroundings::ALL_VOXELS },
        ..check(CheckAs::Colliding)
    };
    assert_eq!(client.check_poses(&map(), regions).await.unwrap().answer.words(), [0b010]);

    let body = json!({"links": [{"spheres": [[0, 0, 0, 0.15]]}]});
    let listed = [at(0.55, 0.2, 0.05), at(0.55, 0.9, 0.05), at(0.55, 0.5, 0.05)];
    let asked = json!({"body": body, "configurations": listed, "answer": "first_hit"});
    let told = json_of(daemon.post("/v1/maps/a/poses", asked).await).await;
    assert_eq!(told["hit_keep_outs"], json!([null, "crate", null]), "{told}");
    assert_eq!(told["hit_voxels"], json!([[5, 0, 0], null, null]));
    let asked = json!({"body": body, "configurations": listed, "ignore_keep_outs": true});
    let told = json_of(daemon.post("/v1/maps/a/poses", asked).await).await;
    assert_eq!(told["colliding"], json!([true, false, false]));
    let asked = json!({"spheres": [[0.55, 0.9, 0.05, 0.15], [0.55, 0.5, 0.05, 0.15]], "answer": "first_hit"});
    let told = json_of(daemon.post("/v1/maps/a/spheres", asked).await).await;
    assert_eq!(
        (&told["colliding"], &told["hit_keep_outs"]),
        (&json!([true, false]), &json!(["crate", null])),
        "{told}"
    );
    let bytes: Vec<u8> = configurations.iter().flat_map(|number| number.to_le_bytes()).collect();
    let head =
        json!({"body": body, "configurations": {"at": 0, "bytes": bytes.len()}, "answer": "first_hit"});
    let answer = daemon.post_bytes("/v1/maps/a/poses", framed(&head, &bytes)).await.bytes().await.unwrap();
    let (head, arrays) = parts(&answer);
    assert_eq!(head["hit_keep_outs"]["names"], json!(["crate"]));
    assert_eq!(array(&head, arrays, "hit_keep_outs"), [[255; 4], [0; 4], [255; 4]].concat());
}

#[tokio::test]
async fn keep_outs_count_for_motions_unless_they_are_ignored() {
    let (daemon, client, replica) = row_and_crate().await;
    let configurations = [at(-1.0, 1.5, 0.05), at(1.0, 1.5, 0.05), at(-1.0, 0.5, 0.05), at(3.0, 0.5, 0.05)];
    let check = MotionCheck {
        asked: Asked::default(),
        body: ball(0.1),
        configurations: configurations.concat(),
        lengths: vec![2, 2],
        step_m: Some(0.01),
        clearance_max_m: Some(2.0),
        surroundings: Surroundings::default(),
    };
    let told = client.check_motions(&map(), check.clone()).await.unwrap();
    same(&replica, &check, &told);
    let [into, beside] = told.answer[..] else { panic!("{told:?}") };
    assert!((into.first_hit.unwrap() - 0.45).abs() < 0.01 && beside.is_free(), "{told:?}");
    assert!((beside.clearance_m.unwrap() - 0.3).abs() < 1e-6, "the row is as near on the other side");
    let ignoring = MotionCheck { asked: but_keep_outs(), ..check };
    assert!(client.check_motions(&map(), ignoring).await.unwrap().answer[0].is_free());
    let body = json!({"links": [{"spheres": [[0, 0, 0, 0.1]]}]});
    for (ignore, free) in [(false, json!([false, true])), (true, json!([true, true]))] {
        let asked = json!({"body": body, "configurations": configurations, "lengths": [2, 2], "ignore_keep_outs": ignore});
        let told = json_of(daemon.post("/v1/maps/a/motions", asked).await).await;
        assert_eq!(told["free"], free, "{told}");
    }
}

#[tokio::test]
async fn keep_outs_count_for_rays_and_points_unless_they_are_ignored() {
    let (daemon, client, replica) = row_and_crate().await;
    let points = |of: &[[f32; 3]]| of.iter().copied().map(Point::from).collect::<Vec<_>>().into();
    let rays = RayQuestion {
        asked: Asked::default(),
        origins: points(&[[0.55, 0.4, 0.05]]),
        toward: RaysToward::Directions {
            directions: points(&[[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]),
            range_m: f64::INFINITY,
        },
        unknown: Unknown::Free,
    };
    let told = client.cast_rays(&map(), rays.clone()).await.unwrap();
    same(&replica, &rays, &told);
    let name = KeepOutName::new("crate").unwrap();
    assert_eq!(told.answer.keep_outs, [Some(name.clone()), None, None]);
    assert!((told.answer.distances_m[0] - 0.6).abs() < 1e-6 && told.answer.hits() == 2, "{told:?}");
    let ignoring = RayQuestion { asked: but_keep_outs(), ..rays };
    let told = client.cast_rays(&map(), ignoring).await.unwrap().answer;
    assert_eq!((told.hits(), told.keep_outs), (1, Vec::new()));
    let asked = json!({"origins": [[0.55, 0.4, 0.05]], "directions": [[0, 1, 0], [0, -1, 0], [0, 0, 1]]});
    let told = json_of(daemon.post("/v1/maps/a/rays", asked).await).await;
    assert_eq!(told["keep_outs"], json!(["crate", null, null]), "{told}");
    assert_eq!((&told["voxels"][0], &told["hit"]), (&Value::Null, &json!([true, true, false])));

    let nearest = NearestQuestion {
        asked: Asked::default(),
        points: points(&[[0.55, 0.9, 0.05], [0.55, 0.2, 0.05], [0.55, 1.5, 0.05]]),
        radius_m: 1.0,
        to: MeasuredTo::Cubes,
    };
    let told = client.find_nearest(&map(), nearest.clone()).await.unwrap();
    same(&replica, &nearest, &told);
    assert_eq!(told.answer.keep_outs, [Some(name.clone()), None, Some(name)]);
    assert_eq!((told.answer.away[0], told.answer.distances_m[2]), ([0.0, -1.0, 0.0], 0.0));
    let ignoring = NearestQuestion { asked: but_keep_outs(), ..nearest };
    assert_eq!(client.find_nearest(&map(), ignoring).await.unwrap().answer.keep_outs, Vec::new());
    let asked = json!({"points": [[0.55, 0.9, 0.05], [0.55, 0.2, 0.05]], "radius_m": 1});
    let told = json_of(daemon.post("/v1/maps/a/nearest", asked).await).await;
    assert_eq!(
        (&told["keep_outs"], &told["voxels"]),
        (&json!(["crate", null]), &json!([null, [5, 0, 0]])),
        "{told}"
    );
}

#[tokio::test]
async fn keep_outs_are_occupied_in_the_map_from_above_unless_they_are_ignored() {
    let (daemon, client, replica) = row_and_crate().await;
    let area = GridArea::Rectangle { min_m: [0.0, 0.0], max_m: [0.4, 1.2] };
    let scope = |band_m| GridScope { area, band_m, cell_m: Some(0.2), tells_unknown: false };
    let question = GridQuestion { asked: Asked::default(), scope: scope([0.0, 1.0]) };
    let told = client.project_grid(&map(), question).await.unwrap().answer;
    assert_eq!((told.size, told.occupied.clone()), ([2, 6], vec![0b1100_0000_0011]));
    assert!(told.tops_m[0] > 0.09 && told.tops_m[10].is_nan(), "a keep-out has no top");
    assert_eq!(replica.ask(&question).unwrap().answer.occupied, told.occupied);
    let above = GridQuestion { asked: Asked::default(), scope: scope([0.6, 1.0]) };
    assert_eq!(client.project_grid(&map(), above).await.unwrap().answer.occupied, [0]);
    let ignoring = GridQuestion { asked: but_keep_outs(), ..question };
    assert_eq!(client.project_grid(&map(), ignoring).await.unwrap().answer.occupied, [0b11]);
    let asked = json!({"area": {"min_m": [0, 0.8], "max_m": [0.4, 1.2]}, "cell_m": 0.2});
    let told = json_of(daemon.post("/v1/maps/a/grid", asked).await).await;
    assert_eq!(told["occupied"], json!([false, false, true, true]), "{told}");
    // The area that is there is that of voxels.
    let told = json_of(daemon.post("/v1/maps/a/grid", json!({})).await).await;
    assert_eq!(told["size"], json!([20, 1]), "{told}");
}

/// A replica of a part of the row, x from 0.3 to 1.5.
async fn part_of(client: &Client) -> Replica {
    let region = Some(Region::cuboid([0.3, -1.0, -1.0], [1.5, 2.5, 1.0]).unwrap());
    Replica::open(client.clone(), map(), ReplicaOptions { region, ..ReplicaOptions::default() })
        .await
        .unwrap()
}

/// The answer of a replica of a part is the server's, or it names what reaches out of it; true of an answer.
fn agrees<Q: Question>(part: &Replica, question: &Q, told: &Q::Answer, named: &str) -> bool
where
    Q::Answer: PartialEq,
{
    match part.ask(question) {
        Ok(own) => {
            assert_eq!((&own.answer, own.version.content_hash), (told, None));
            true
        }
        Err(error) => {
            let said = error.to_string();
            assert!(said.contains(named) && said.contains("the region that the replica copies"), "{said}");
            false
        }
    }
}

#[tokio::test]
async fn a_replica_of_a_region_answers_what_lies_in_it() {
    let (_daemon, client, _) = row_and_crate().await;
    let part = part_of(&client).await;
    let mut answered = Vec::new();
    for x in 0..20 {
        let x = x as f32 * 0.1 + 0.05;
        let mut told = Vec::new();
        for answer in [CheckAs::Colliding, CheckAs::FirstHit, CheckAs::Clearance { most_m: Some(0.3) }] {
            let check = PoseCheck { configurations: at(x, 0.3, 0.05).to_vec(), ..poses(answer) };
            let of_server = client.check_poses(&map(), check.clone()).await.unwrap().answer;
            told.push(agrees(&part, &check, &of_server, "configurations[0].links[0]"));
        }
        let spheres = SphereCheck {
            asked: Asked::default(),
            spheres: vec![Sphere { center_m: [x, 0.3, 0.05], radius_m: 0.15 }],
            sizes: vec![1],
            padding_m: 0.0,
            surroundings: Surroundings::default(),
            answer: CheckAs::FirstHit,
        };
        let of_server = client.check_spheres(&map(), spheres.clone()).await.unwrap().answer;
        assert_eq!(agrees(&part, &spheres, &of_server, "spheres[0]"), told[0]);
        let points = NearestQuestion {
            asked: Asked::default(),
            points: vec![Point::new(x, 0.3, 0.05)].into(),
            radius_m: 1.0,
            to: MeasuredTo::Cubes,
        };
        let of_server = client.find_nearest(&map(), points.clone()).await.unwrap().answer;
        told.push(agrees(&part, &points, &of_server, "points[0]"));
        answered.push((told[0], told[2], told[3]));
    }
    // Within 0.15 m and a voxel's diagonal of the border nothing is said; a voxel that is 0.2 m away is the nearest there is.
    let inside: Vec<_> = (0..20).filter(|i| answered[*i].0).collect();
    assert_eq!(inside, (6..=11).collect::<Vec<_>>(), "{answered:?}");
    assert!(answered[7] == (true, true, true) && !answered[6].1, "{answered:?}");
}

#[tokio::test]
async fn a_replica_of_a_region_says_which_motions_rays_and_grids_leave_it() {
    let (_daemon, client, _) = row_and_crate().await;
    let part = part_of(&client).await;
    let motion = |configurations: [[f32; 7]; 2], clearance_max_m| MotionCheck {
        asked: Asked::default(),
        body: ball(0.1),
        configurations: configurations.concat(),
        lengths: vec![2],
        step_m: None,
        clearance_max_m,
        surroundings: Surroundings::default(),
    };
    let inside = [at(0.6, 0.3, 0.0), at(1.2, 0.5, 0.0)];
    for (configurations, clearance_max_m, is_known) in [
        (inside, None, true),
        (inside, Some(0.5), false),
        ([at(0.6, 0.8, 0.0), at(1.2, 0.0, 0.0)], Some(0.5), true),
        ([at(0.6, 0.3, 0.0), at(1.45, 0.5, 0.0)], None, false),
        ([at(0.6, 0.3, 0.0), at(9.0, 0.5, 0.0)], None, false),
    ] {
        let check = motion(configurations, clearance_max_m);
        let of_server = client.check_motions(&map(), check.clone()).await.unwrap().answer;
        assert_eq!(agrees(&part, &check, &of_server, "configurations["), is_known, "{configurations:?}");
    }
    let points = |of: [f32; 3]| vec![Point::from(of)].into();
    for (from, direction, range_m, is_known) in [
        ([0.9, 0.5, 0.05], [0.0, -1.0, 0.0], f64::INFINITY, true),
        ([0.9, 0.5, 0.05], [0.0, 1.0, 0.0], f64::INFINITY, true),
        ([0.9, 0.5, 0.05], [1.0, 0.0, 0.0], 0.3, true),
        ([0.9, 0.5, 0.05], [1.0, 0.0, 0.0], 0.5, false),
        ([0.9, 0.5, 0.05], [0.0, 0.0, 1.0], f64::INFINITY, false),
        ([0.1, 0.5, 0.05], [1.0, 0.0, 0.0], 0.5, false),
    ] {
        let toward = RaysToward::Directions { directions: points(direction), range_m };
        let rays =
            RayQuestion { asked: Asked::default(), origins: points(from), toward, unknown: Unknown::Free };
        let of_server = client.cast_rays(&map(), rays.clone()).await.unwrap().answer;
        assert_eq!(agrees(&part, &rays, &of_server, "rays[0]"), is_known, "{from:?} {direction:?}");
    }
    for (area, band_m, is_known) in [
        (Some([[0.5, 0.0], [1.2, 1.5]]), [-0.5, 0.5], true),
        (Some([[0.5, 0.0], [1.4, 1.5]]), [-0.5, 0.5], false),
        (Some([[0.5, 0.0], [1.2, 1.5]]), [-0.5, f64::INFINITY], false),
        (None, [-0.5, 0.5], false),
    ] {
        let area = area.map_or(GridArea::Occupied, |[min_m, max_m]| GridArea::Rectangle { min_m, max_m });
        let question = GridQuestion {
            asked: Asked::default(),
            scope: GridScope { area, band_m, cell_m: None, tells_unknown: false },
        };
        let own = part.ask(&question);
        assert_eq!(own.is_ok(), is_known, "{area:?} {band_m:?}");
        match own {
            Ok(own) => {
                let told = client.project_grid(&map(), question).await.unwrap().answer;
                assert_eq!((own.answer.size, own.answer.occupied), (told.size, told.occupied));
            }
            Err(error) => assert!(error.to_string().contains("area"), "{error}"),
        }
    }
}

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
        asked: Asked { ignore_keep_outs, min_revision: Some(2), ..Asked::default() },
        configurations: at(0.55, 1.5, 0.05).to_vec(),
        ..poses(CheckAs::Colliding)
    };
    let batches = tokio_stream::iter([batch(false), batch(true)]);
    let mut answers = client.pose_stream(&map(), batches).await.unwrap();
    for words in [[1], [0]] {
        assert_eq!(tokio_stream::StreamExt::next(&mut answers).await.unwrap().unwrap().answer.words(), words);
    }
    let late = PoseCheck { asked: Asked { min_revision: Some(3), ..Asked::default() }, ..batch(false) };
    assert!(replica.ask(&late).unwrap_err().to_string().contains("the copy is at 2"));
}
