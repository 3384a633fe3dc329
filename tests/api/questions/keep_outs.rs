//! Keep-outs count in every question, unless they are ignored.

use super::{array, at, ball, but_keep_outs, framed, map, parts, poses, row_and_crate, same};

use mrol::geometry::Point;
use mrol::map::{KeepOutName, Region};
use mrol::planning::{BandFrom, GridArea, MeasuredTo, Met, Surroundings, Unknown};
use mrol::service::{
    CheckAs, Collisions, GridQuestion, GridScope, MotionCheck, NearestQuestion, PoseCheck, QuestionScope,
    RayQuestion, RaysToward,
};
use mrol::voxel::VoxelKey;
use serde_json::{Value, json};

use crate::support::daemon::json_of;

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
        asked: QuestionScope::default(),
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
        asked: QuestionScope::default(),
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
        asked: QuestionScope::default(),
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
    let scope = |band_m| GridScope {
        area,
        band_m,
        band_from: BandFrom::Map,
        cell_m: Some(0.2),
        tells_unknown: false,
    };
    let question = GridQuestion { asked: QuestionScope::default(), scope: scope([0.0, 1.0]) };
    let told = client.project_grid(&map(), question).await.unwrap().answer;
    assert_eq!((told.size, told.occupied.clone()), ([2, 6], vec![0b1100_0000_0011]));
    assert!(told.tops_m[0] > 0.09 && told.tops_m[10].is_nan(), "a keep-out has no top");
    assert_eq!(replica.ask(&question).unwrap().answer.occupied, told.occupied);
    let above = GridQuestion { asked: QuestionScope::default(), scope: scope([0.6, 1.0]) };
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
