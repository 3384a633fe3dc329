//! Questions for which unknown voxels are occupied, against a map in which each voxel is occupied that is not free:
//! through scans, deletions and undo, at all levels.

use proptest::prelude::*;

use super::seen_maps::{SeenHistory, seen_history_and_level};
use crate::geometry::Point;
use crate::map::Region;
use crate::planning::*;
use crate::util::StopSignal;

const NEVER: StopSignal<'static> = StopSignal::NEVER;

fn link() -> impl Strategy<Value = Link> {
    let radius = prop_oneof![3 => 0.0f32..0.6, 1 => 0.0f32..2.5, 1 => (0i32..8).prop_map(|n| n as f32 / 8.0)];
    let number = || prop_oneof![(-8i32..=8).prop_map(|n| n as f32 / 8.0), -1.0f32..1.0];
    let sphere = (prop::array::uniform3(number()), radius)
        .prop_map(|(center_m, radius_m)| Sphere { center_m, radius_m });
    let points = prop::collection::vec(prop::array::uniform3(number()).prop_map(Point::from), 0..20);
    let padding = prop_oneof![2 => Just(0.0), 1 => 0.0f32..0.4];
    (prop::collection::vec(sphere, 0..10), points, padding).prop_map(|(spheres, points, padding_m)| Link {
        spheres,
        points,
        padding_m,
    })
}

fn pose() -> impl Strategy<Value = [f32; 7]> {
    let turned = prop::array::uniform4(-1.0f32..1.0).prop_map(|q| {
        let norm = q.iter().map(|c| c * c).sum::<f32>().sqrt();
        if norm > 0.1 { q.map(|c| c / norm) } else { [0.0, 0.0, 0.0, 1.0] }
    });
    (prop::array::uniform3(-4.0f32..4.0), turned).prop_map(|([x, y, z], [a, b, c, d])| [x, y, z, a, b, c, d])
}

fn body_and_poses() -> impl Strategy<Value = (Body, Vec<f32>)> {
    let links = prop::collection::vec(link(), 1..3)
        .prop_filter("a body has a part", |links| links.iter().any(Link::has_parts));
    links.prop_flat_map(|links| {
        let poses = prop::collection::vec(pose(), links.len() * 4);
        (Just(Body::new(links).unwrap()), poses.prop_map(|poses| poses.concat()))
    })
}

fn ignored() -> impl Strategy<Value = Vec<Region>> {
    let ball = (prop::array::uniform3(-4.0f64..4.0), 0.0f64..2.0)
        .prop_map(|(center_m, radius_m)| Region::ball(center_m, radius_m).unwrap());
    prop_oneof![2 => Just(Vec::new()), 1 => prop::collection::vec(ball, 1..3)]
}

/// Asks a planner whose fields live through the history, after each step of it, and one of the solid map: both answer
/// alike.
fn through_steps<A: PartialEq + std::fmt::Debug>(
    history: &SeenHistory,
    level: u32,
    (ignored, field_bytes_max): (&[Region], usize),
    ask: impl Fn(&PlanningView<'_>, u32, &Surroundings) -> A,
) -> Result<(), TestCaseError> {
    let mut seen = history.first();
    let planner = Planner::with_field_bytes(seen.map.clone(), field_bytes_max);
    let [careful, plain] =
        [Unknown::Occupied, Unknown::Free].map(|unknown| Surroundings { ignored: ignored.to_vec(), unknown });
    for step in 0..SeenHistory::STEPS {
        history.go_on(&mut seen, step);
        // One after the other: a thread holds the locks of one map at a time.
        let told = ask(&planner.view().with_viewpoints(), level, &careful);
        let expected = ask(&Planner::new(seen.solid(level)).view(), 0, &plain);
        prop_assert_eq!(told, expected, "after step {}", step);
    }
    Ok(())
}

/// Three voxels of a level, meters.
fn near_m(view: &PlanningView<'_>, level: u32) -> f32 {
    (3.0 * view.lattice().resolution_m(level)) as f32
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn bodies_meet_what_is_not_free(
        (history, level) in seen_history_and_level(),
        (body, numbers) in body_and_poses(),
        ignored in ignored(),
        field_bytes_max in prop::sample::select(vec![0, 20_000, 16 << 20]),
    ) {
        let configurations = Configurations::new(&numbers, body.links().len()).unwrap();
        let (body, spheres) = (&body, body.links()[0].spheres.clone());
        let sizes = [spheres.len() as u32];
        let groups = SphereGroups::new(&spheres, &sizes).unwrap();
        through_steps(&history, level, (&ignored, field_bytes_max), |view, level, surroundings| {
            let question = PoseQuestion { body, configurations, level, surroundings };
            let of_spheres = SphereQuestion { groups, padding_m: 0.1, level, surroundings };
            (
                view.bodies_meet(&question, NEVER),
                view.first_hits(&question, NEVER),
                view.clearances(&question, near_m(view, level), NEVER),
                view.spheres_meet(&of_spheres, NEVER),
                view.first_sphere_hits(&of_spheres, NEVER),
            )
        })?;
    }

    #[test]
    fn motions_end_where_something_is_not_free(
        (history, level) in seen_history_and_level(),
        (body, numbers) in body_and_poses(),
        two in any::<bool>(),
    ) {
        let configurations = Configurations::new(&numbers, body.links().len()).unwrap();
        let lengths: &[u32] = if two { &[2, 2] } else { &[4] };
        let body = &body;
        through_steps(&history, level, (&[], 16 << 20), |view, level, surroundings| {
            let clearance_max_m = Some(near_m(view, level));
            let question = MotionQuestion {
                body, configurations, lengths, step_m: None, clearance_max_m, level, surroundings,
            };
            view.check_motions(&question, NEVER)
        })?;
    }

    #[test]
    fn rays_end_where_something_is_not_free(
        (history, level) in seen_history_and_level(),
        rays in prop::collection::vec((prop::array::uniform3(-5.0f32..5.0), prop::array::uniform3(-1.0f32..1.0)), 1..40),
        range_m in prop_oneof![Just(f64::INFINITY), 0.1f64..8.0],
    ) {
        let (seen, axes) = (history.map(), [[1.0f32, 0.0, 0.0], [0.0, -1.0, 0.0]]);
        let unit = |(i, d): (usize, [f32; 3])| {
            let length = d.iter().map(|c| c * c).sum::<f32>().sqrt();
            if length > 0.1 && i % 5 > 0 { d.map(|c| c / length) } else { axes[i % 2] }
        };
        let (origins, directions): (Vec<_>, Vec<_>) = rays.into_iter().unzip();
        let origins: Vec<Point> = origins.into_iter().map(Point::from).collect();
        let directions: Vec<Point> = directions.into_iter().enumerate().map(|of| Point::from(unit(of))).collect();
        let rays = Rays { origins: &origins, toward: Toward::Directions { directions: &directions, range_m } };
        let told = cast_rays_in_sight(&seen.map.view().with_viewpoints(), &rays, level, NEVER).unwrap();
        let solid = seen.solid(level);
        prop_assert_eq!(told, cast_rays(&solid.view(), &rays, 0, NEVER).unwrap());
    }
}

#[test]
fn what_nobody_saw_is_met_up_to_where_the_lattice_ends_and_nothing_is_said_of_what_is_beyond() {
    let map = crate::map::MultiResolutionMap::new(crate::map::MapSettings::new(1.0, 12)).unwrap();
    let planner = Planner::new(std::sync::Arc::new(map));
    let spheres = vec![Sphere { center_m: [0.0; 3], radius_m: 0.25 }];
    let body = Body::new(vec![Link { spheres, ..Link::default() }]).unwrap();
    let careful = Surroundings { unknown: Unknown::Occupied, ..Surroundings::ALL_VOXELS };
    let end_m = (1u32 << 20) as f32;
    for level in [0, 5, 11] {
        for (x, is_within) in
            [(0.0, true), (-end_m + 1.0, true), (end_m - 8.0, true), (end_m, false), (-end_m - 2.0, false)]
        {
            let numbers = [x, 0.5, 0.5, 0.0, 0.0, 0.0, 1.0];
            let configurations = Configurations::new(&numbers, 1).unwrap();
            let question = PoseQuestion { body: &body, configurations, level, surroundings: &careful };
            let told = planner.view().with_viewpoints().bodies_meet(&question, NEVER);
            assert_eq!(told.ok().flatten(), is_within.then(|| vec![1]), "{x} at level {level}");
        }
        let (origins, directions) = ([Point::new(end_m - 3.0, 0.0, 0.0)], [Point::new(1.0, 0.0, 0.0)]);
        let toward = Toward::Directions { directions: &directions, range_m: f64::INFINITY };
        let rays = Rays { origins: &origins, toward };
        let told = cast_rays_in_sight(&planner.map().view().with_viewpoints(), &rays, level, NEVER).unwrap();
        assert_eq!((told.hits(), told.distances_m[0]), (1, 0.0));
    }
}
