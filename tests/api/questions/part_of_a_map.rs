//! Questions to a replica of a part of the map.

use super::{at, ball, map, poses, row_and_crate};

use mrol::client::{Client, Replica, ReplicaOptions};
use mrol::geometry::Point;
use mrol::map::Region;
use mrol::planning::{BandFrom, GridArea, MeasuredTo, Sphere, Surroundings, Unknown};
use mrol::service::{
    CheckAs, GridQuestion, GridScope, MotionCheck, NearestQuestion, PoseCheck, Question, QuestionScope,
    RayQuestion, RaysToward, SphereCheck,
};

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
            asked: QuestionScope::default(),
            spheres: vec![Sphere { center_m: [x, 0.3, 0.05], radius_m: 0.15 }],
            sizes: vec![1],
            padding_m: 0.0,
            surroundings: Surroundings::default(),
            answer: CheckAs::FirstHit,
        };
        let of_server = client.check_spheres(&map(), spheres.clone()).await.unwrap().answer;
        assert_eq!(agrees(&part, &spheres, &of_server, "spheres[0]"), told[0]);
        let points = NearestQuestion {
            asked: QuestionScope::default(),
            points: vec![Point::new(x, 0.3, 0.05)].into(),
            radius_m: 1.0,
            to: MeasuredTo::Cubes,
        };
        let of_server = client.find_nearest(&map(), points.clone()).await.unwrap().answer;
        told.push(agrees(&part, &points, &of_server, "points[0]"));
        answered.push((told[0], told[2], told[3]));
    }
    // Within 0.15 m and a voxel's diagonal of the border nothing is said; a voxel that is 0.2 m away is the nearest
    // there is.
    let inside: Vec<_> = (0..20).filter(|i| answered[*i].0).collect();
    assert_eq!(inside, (6..=11).collect::<Vec<_>>(), "{answered:?}");
    assert!(answered[7] == (true, true, true) && !answered[6].1, "{answered:?}");
}

#[tokio::test]
async fn a_replica_of_a_region_says_which_motions_rays_and_grids_leave_it() {
    let (_daemon, client, _) = row_and_crate().await;
    let part = part_of(&client).await;
    let motion = |configurations: [[f32; 7]; 2], clearance_max_m| MotionCheck {
        asked: QuestionScope::default(),
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
        let rays = RayQuestion {
            asked: QuestionScope::default(),
            origins: points(from),
            toward,
            unknown: Unknown::Free,
        };
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
            asked: QuestionScope::default(),
            scope: GridScope { area, band_m, band_from: BandFrom::Map, cell_m: None, tells_unknown: false },
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
