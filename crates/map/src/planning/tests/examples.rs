//! What has an answer that anybody can tell.

use std::sync::Arc;

use super::made::{RESOLUTION_M, exchange};
use crate::geometry::Point;
use crate::map::{MapSettings, MultiResolutionMap};
use crate::planning::*;
use crate::util::StopSignal;

#[test]
fn a_sphere_that_touches_a_face_an_edge_or_a_corner_meets() {
    let map = Arc::new(MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 2)).unwrap());
    exchange(&map, &(Vec::new(), vec![[0, 0, 0], [-8, 5, 5]]));
    let planner = Planner::new(map);
    let meets = |center_m: [f32; 3], radius_m: f32| {
        let spheres = [Sphere { center_m, radius_m }];
        let groups = SphereGroups::new(&spheres, &[1]).unwrap();
        let question =
            SphereQuestion { groups, padding_m: 0.0, level: 0, surroundings: &Surroundings::ALL_VOXELS };
        planner.view().spheres_meet(&question, StopSignal::NEVER).unwrap().unwrap()[0] == 1
    };
    for (center_m, distance_m) in [
        ([0.75, 0.25, 0.25], 0.25f32),
        ([0.25, -1.5, 0.0], 1.5),
        ([0.875, 1.0, 0.5], 0.625),
        ([-0.25, -0.5, -0.5], 0.75),
        ([2.0, 1.0, 1.5], 1.870_828_7),
        ([0.25, 0.25, 0.25], 0.0),
        ([0.5, 0.5, 0.5], 0.0),
    ] {
        assert!(meets(center_m, distance_m), "{center_m:?}");
        assert!(distance_m == 0.0 || !meets(center_m, distance_m * (1.0 - 1e-6)), "{center_m:?}");
    }
}

#[test]
fn questions_that_make_no_sense_are_refused_by_name() {
    let map = Arc::new(MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 3)).unwrap());
    let planner = Planner::new(map);
    let sphere = Sphere { center_m: [0.0; 3], radius_m: 300.0 };
    let body = Body::new(vec![Link { spheres: vec![sphere], ..Link::default() }]).unwrap();
    let numbers = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].repeat(4);
    let configurations = Configurations::new(&numbers, 1).unwrap();
    let view = planner.view();
    let poses = |level, configurations| {
        let question =
            PoseQuestion { body: &body, configurations, level, surroundings: &Surroundings::ALL_VOXELS };
        view.bodies_meet(&question, StopSignal::NEVER).map_err(|e| e.to_string())
    };
    assert!(poses(0, configurations).unwrap_err().contains("radius of 600 voxels"));
    assert_eq!(poses(1, configurations), Ok(Some(vec![0])));
    assert!(poses(3, configurations).unwrap_err().contains("level must lie in 0..=2, got 3"));
    assert!(
        poses(1, Configurations::new(&numbers, 2).unwrap()).unwrap_err().contains("1 links has 7 numbers")
    );
    let motions = |lengths: &[u32], step_m, clearance_max_m| {
        let level = 1;
        let surroundings = &Surroundings::ALL_VOXELS;
        let question = MotionQuestion {
            body: &body,
            configurations,
            lengths,
            step_m,
            clearance_max_m,
            level,
            surroundings,
        };
        view.check_motions(&question, StopSignal::NEVER).map_err(|e| e.to_string())
    };
    assert!(motions(&[2, 2], None, Some(64.0)).is_ok());
    assert!(motions(&[2, 2], None, Some(64.1)).unwrap_err().contains("clearance_max_m must lie in 0..=64"));
    assert!(motions(&[4], Some(0.0), None).unwrap_err().contains("step_m must lie in"));
    // The float next to the least step is less than it.
    assert_eq!(motions(&[4], Some(1e-5), None).err(), None);
    assert!(motions(&[4], Some(1e-5f32.next_down()), None).unwrap_err().contains("step_m must lie in"));
    assert!(
        motions(&[3, 1], None, None)
            .unwrap_err()
            .contains("at least 2 configurations each, 4 in all, got [3, 1]")
    );
    assert!(motions(&[2], None, None).is_err());
    let groups = SphereGroups::new(&[sphere], &[2]).unwrap_err();
    assert!(groups.to_string().contains("2 spheres in all, got 1"));
    // By its number among all of them, whatever its group.
    let small = Sphere { center_m: [0.0; 3], radius_m: 0.1 };
    let spheres = [small, sphere];
    let groups = SphereGroups::new(&spheres, &[1, 1]).unwrap();
    let question =
        SphereQuestion { groups, padding_m: 0.0, level: 0, surroundings: &Surroundings::ALL_VOXELS };
    let too_large = view.spheres_meet(&question, StopSignal::NEVER).unwrap_err();
    assert!(too_large.to_string().starts_with("spheres[1] has a radius of "), "{too_large}");
    let broken = Sphere { radius_m: -1.0, ..small };
    let refused = SphereGroups::new(&[small, small, broken], &[1, 2]).unwrap_err();
    assert!(refused.to_string().starts_with("spheres[2] must have "), "{refused}");
    let stop = || true;
    let question =
        PoseQuestion { body: &body, configurations, level: 1, surroundings: &Surroundings::ALL_VOXELS };
    assert_eq!(view.bodies_meet(&question, StopSignal::when(&stop)), Ok(None));
}

#[test]
fn the_fields_are_counted_and_bounded() {
    let map = Arc::new(MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 3)).unwrap());
    let wall: Vec<_> = (0..100 * 100).map(|n| [n % 100 * 4, n / 100 * 4, 3]).collect();
    exchange(&map, &(Vec::new(), wall));
    let before = map.memory_bytes();
    let body =
        Body::new(vec![Link { points: vec![Point::new(0.0, 0.0, 0.0)], padding_m: 0.1, ..Link::default() }]);
    let body = body.unwrap();
    let numbers: Vec<f32> =
        (0..2000).flat_map(|n| [n as f32 / 10.0, 200.0 - n as f32 / 10.0, 3.1, 0.0, 0.0, 0.0, 1.0]).collect();
    let configurations = Configurations::new(&numbers, 1).unwrap();
    for most in [30_000, 1 << 20] {
        let planner = Planner::with_field_bytes(Arc::clone(&map), most);
        let question =
            PoseQuestion { body: &body, configurations, level: 0, surroundings: &Surroundings::ALL_VOXELS };
        planner.view().bodies_meet(&question, StopSignal::NEVER).unwrap();
        let held = planner.field_bytes();
        assert!((10_000..most).contains(&held), "{held}");
        assert_eq!(map.memory_bytes(), before + held);
        drop(planner);
        assert_eq!(map.memory_bytes(), before);
    }
}

#[test]
fn answers_are_those_of_the_views_own_revision_while_the_map_changes() {
    let settings = MapSettings::new(RESOLUTION_M, 4);
    let wall = |x: i32| (0..400).map(|n| [x, n % 20 - 10, n / 20 - 10]).collect::<Vec<_>>();
    let states = [wall(3), wall(-4)];
    let body = Body::new(vec![Link {
        spheres: vec![Sphere { center_m: [0.0; 3], radius_m: 0.6 }],
        ..Link::default()
    }]);
    let body = body.unwrap();
    let numbers: Vec<f32> =
        (0..200).flat_map(|n| [n as f32 / 20.0 - 5.0, 0.3, 0.1, 0.0, 0.0, 0.0, 1.0]).collect();
    let configurations = Configurations::new(&numbers, 1).unwrap();
    let question =
        PoseQuestion { body: &body, configurations, level: 0, surroundings: &Surroundings::ALL_VOXELS };
    let ask = |planner: &Planner| {
        let view = planner.view();
        (view.version().revision, view.bodies_meet(&question, StopSignal::NEVER).unwrap().unwrap())
    };
    let expected = states.each_ref().map(|state| {
        let map = Arc::new(MultiResolutionMap::new(settings).unwrap());
        exchange(&map, &(Vec::new(), state.clone()));
        ask(&Planner::new(map)).1
    });
    assert_ne!(expected[0], expected[1]);
    let map = Arc::new(MultiResolutionMap::new(settings).unwrap());
    exchange(&map, &(Vec::new(), states[1].clone()));
    let planner = Planner::new(Arc::clone(&map));
    std::thread::scope(|threads| {
        for _ in 0..2 {
            threads.spawn(|| {
                let mut last = 0;
                while last < 200 {
                    let (revision, answer) = ask(&planner);
                    assert_eq!(answer, expected[(revision % 2) as usize], "at revision {revision}");
                    last = revision;
                }
            });
        }
        for revision in 2..=200 {
            let [now, before] = [revision % 2, 1 - revision % 2].map(|n| states[n].clone());
            exchange(&map, &(before, now));
        }
    });
}
