//! Every question is answered alike over gRPC, over HTTP in both forms, and by a replica.

use super::{array, at, ball, framed, map, parts, poses, row_of_voxels, same};

use mrol::geometry::Point;
use mrol::map::Region;
use mrol::planning::{BandFrom, GridArea, MeasuredTo, Sphere, Surroundings, Unknown};
use mrol::service::{
    CheckAs, Collisions, GridQuestion, GridScope, MotionCheck, NearestQuestion, PoseCheck, QuestionScope,
    RayQuestion, RaysToward, SphereCheck,
};
use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::support::daemon::json_of;

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
        asked: QuestionScope::default(),
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
        asked: QuestionScope::default(),
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
        asked: QuestionScope::default(),
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
        asked: QuestionScope::default(),
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
    let scope = GridScope {
        area,
        band_m: [0.0, 1.0],
        band_from: BandFrom::Map,
        cell_m: Some(0.2),
        tells_unknown: false,
    };
    let question = GridQuestion { asked: QuestionScope::default(), scope };
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
