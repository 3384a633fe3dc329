//! Questions about bodies at poses and along motions, through changes of the map, at all levels.

use std::sync::Arc;

use proptest::prelude::*;

use super::brute_force::{BruteForce, every_step};
use super::made::{
    Exchange, RESOLUTION_M, body_and_poses, exchange, exchanges, indices, link, near_pose, number, radius_m,
    surroundings,
};
use crate::map::{MapSettings, MultiResolutionMap};
use crate::planning::body::LinkPose;
use crate::planning::*;
use crate::util::StopSignal;

fn bits(words: &[u64], count: usize) -> Vec<bool> {
    (0..count).map(|n| words[n / 64] >> (n % 64) & 1 == 1).collect()
}

/// Asks everything of poses, and compares.
fn check_poses(
    planner: &Planner,
    body: &Body,
    numbers: &[f32],
    level: u32,
    surroundings: &Surroundings,
) -> Result<(), TestCaseError> {
    let configurations = Configurations::new(numbers, body.links().len()).unwrap();
    let oracle = BruteForce::of(planner.map(), level, surroundings);
    let question = PoseQuestion { body, configurations, level, surroundings };
    let view = planner.view();
    let meets = view.bodies_meet(&question, StopSignal::NEVER).unwrap().unwrap();
    let hits = view.first_hits(&question, StopSignal::NEVER).unwrap().unwrap();
    let most_m = (20.0 * planner.map().lattice().resolution_m(level)) as f32;
    let clearances = view.clearances(&question, most_m, StopSignal::NEVER).unwrap().unwrap();
    for (number, meets) in bits(&meets, configurations.len()).into_iter().enumerate() {
        let poses: Vec<_> = configurations.poses_of(number).iter().map(LinkPose::of).collect();
        let hit = oracle.first_hit(body, &poses);
        prop_assert_eq!(meets, hit.is_some(), "configuration {}", number);
        prop_assert_eq!(&hits[number], &hit);
        prop_assert_eq!(clearances[number], oracle.clearance(body, &poses, most_m));
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn poses_are_answered_as_by_brute_force_through_changes(
        indices in indices(),
        exchanges in exchanges(),
        levels in 1u32..=5,
        (body, numbers) in body_and_poses(1..5),
        surroundings in surroundings(),
        field_bytes_max in prop::sample::select(vec![0, 5000, 1 << 20]),
    ) {
        let map = Arc::new(MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, levels)).unwrap());
        exchange(&map, &(Vec::new(), indices));
        let planner = Planner::with_field_bytes(Arc::clone(&map), field_bytes_max);
        for level in 0..levels {
            check_poses(&planner, &body, &numbers, level, &surroundings)?;
        }
        for change in exchanges {
            exchange(&map, &change);
            for level in 0..levels {
                check_poses(&planner, &body, &numbers, level, &surroundings)?;
            }
        }
    }

    #[test]
    fn many_places_of_one_link_are_answered_as_by_brute_force(
        indices in indices(),
        levels in 1u32..=3,
        link in link().prop_filter("a body has a part", Link::has_parts),
        poses in prop::collection::vec(near_pose(), 1..20),
        surroundings in surroundings(),
        field_bytes_max in prop::sample::select(vec![0, 1 << 20]),
    ) {
        let map = Arc::new(MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, levels)).unwrap());
        exchange(&map, &(Vec::new(), indices));
        let planner = Planner::with_field_bytes(Arc::clone(&map), field_bytes_max);
        let body = Body::new(vec![link]).unwrap();
        for level in 0..levels {
            check_poses(&planner, &body, &poses.concat(), level, &surroundings)?;
        }
    }

    #[test]
    fn groups_of_spheres_are_answered_as_bodies_at_the_origin(
        indices in indices(),
        level in 0u32..3,
        groups in prop::collection::vec((prop::collection::vec((prop::array::uniform3(number(8)), radius_m()), 0..6), number(8)), 0..5),
        padding_m in prop_oneof![Just(0.0f32), 0.0f32..0.5],
        surroundings in surroundings(),
    ) {
        let map = Arc::new(MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 3)).unwrap());
        exchange(&map, &(Vec::new(), indices));
        let planner = Planner::new(Arc::clone(&map));
        let sphere = |(center_m, radius_m): &([f32; 3], f32)| Sphere { center_m: *center_m, radius_m: *radius_m };
        let sizes: Vec<u32> = groups.iter().map(|(group, _)| group.len() as u32).collect();
        let spheres: Vec<Sphere> = groups.iter().flat_map(|(group, _)| group.iter().map(sphere)).collect();
        let oracle = BruteForce::of(&map, level, &surroundings);
        let groups_of = SphereGroups::new(&spheres, &sizes).unwrap();
        let question = SphereQuestion { groups: groups_of, padding_m, level, surroundings: &surroundings };
        let view = planner.view();
        let meets = view.spheres_meet(&question, StopSignal::NEVER).unwrap().unwrap();
        let hits = view.first_sphere_hits(&question, StopSignal::NEVER).unwrap().unwrap();
        let clearances = view.sphere_clearances(&question, 3.0, StopSignal::NEVER).unwrap().unwrap();
        for (number, (group, _)) in groups.iter().enumerate() {
            let link = Link { spheres: group.iter().map(sphere).collect(), points: Vec::new(), padding_m };
            // No sphere meets nothing.
            let Ok(body) = Body::new(vec![link]) else {
                prop_assert!(!bits(&meets, groups.len())[number] && hits[number].is_none());
                continue;
            };
            let expected = oracle.first_hit(&body, &[LinkPose::of(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])]);
            prop_assert_eq!(bits(&meets, groups.len())[number], expected.is_some());
            prop_assert_eq!(&hits[number], &expected);
            prop_assert_eq!(clearances[number], oracle.clearance(&body, &[LinkPose::of(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])], 3.0));
        }
    }

    #[test]
    fn motions_are_answered_as_if_every_step_were_looked_at(
        indices in indices(),
        exchanges in exchanges(),
        level in 0u32..3,
        (body, numbers) in body_and_poses(4..5),
        step_m in prop_oneof![2 => Just(None), 1 => (0.05f32..2.0).prop_map(Some)],
        two in prop::bool::ANY,
        surroundings in surroundings(),
    ) {
        // Not so far that brute force takes for ever.
        let numbers: Vec<f32> = numbers.into_iter().map(|n| n.clamp(-12.0, 12.0)).collect();
        let map = Arc::new(MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 3)).unwrap());
        exchange(&map, &(Vec::new(), indices));
        let planner = Planner::new(Arc::clone(&map));
        let configurations = Configurations::new(&numbers, body.links().len()).unwrap();
        let lengths: &[u32] = if two { &[2, 2] } else { &[4] };
        let question = MotionQuestion {
            body: &body, configurations, lengths, step_m, clearance_max_m: Some(4.0), level, surroundings: &surroundings,
        };
        let again = exchanges.first().cloned().unwrap_or_default();
        for change in [Exchange::default(), again] {
            exchange(&map, &change);
            let answers = planner.view().check_motions(&question, StopSignal::NEVER).unwrap().unwrap();
            let oracle = BruteForce::of(&map, level, &surroundings);
            let mut first = 0;
            for (answer, length) in answers.iter().zip(lengths) {
                let expected = every_step(&oracle, &question, first, *length as usize);
                first += *length as usize;
                prop_assert_eq!(*answer, expected);
            }
        }
    }
}
