//! What nobody saw: points, bodies, rays, frontiers and the map from above, alike everywhere.

use super::{array, at, ball, framed, map, parts, poses, row_of_voxels, same};

use mrol::geometry::Point;
use mrol::planning::{BandFrom, Frontiers, GridArea, PointState, Sphere, Surroundings, Unknown};
use mrol::service::{
    CheckAs, ClassifyQuestion, FrontierQuestion, GridQuestion, GridScope, MotionCheck, PoseCheck,
    QuestionScope, RayQuestion, RaysToward, SphereCheck,
};
use serde_json::json;

use crate::support::daemon::json_of;

#[tokio::test]
async fn points_that_nobody_saw_are_unknown_everywhere() {
    let (daemon, client, replica) = row_of_voxels().await;
    let points: Vec<Point> = [[0.55, 0.05, 0.05], [0.55, 0.35, 0.05]].map(Point::from).to_vec();
    let question = ClassifyQuestion { asked: QuestionScope::default(), points: points.clone().into() };
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
        asked: QuestionScope::default(),
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
        asked: QuestionScope::default(),
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
        asked: QuestionScope::default(),
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
        asked: QuestionScope::default(),
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
    let scope = GridScope {
        area,
        band_m: [0.0, 1.0],
        band_from: BandFrom::Map,
        cell_m: Some(0.2),
        tells_unknown: true,
    };
    let question = GridQuestion { asked: QuestionScope::default(), scope };
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
