//! Planners' answers against brute force over all voxels, by the one definition of when a ball meets a cube; through changes
//! of the map, at all levels.

use std::collections::BTreeSet;
use std::sync::Arc;

use proptest::prelude::*;

use super::cubes::squared_distance;
use super::path::LinkMotion;
use super::placement::{CellsFromLink, LinkPose};
use super::*;
use crate::geometry::Point;
use crate::map::{MapSettings, MultiResolutionMap, Region};
use crate::util::StopSignal;
use crate::voxel::{Lattice, VoxelKey, VoxelSet};

const RESOLUTION_M: f64 = 0.5;

/// All voxels of a level, looked at one by one.
struct BruteForce {
    voxels: BTreeSet<VoxelKey>,
    lattice: Lattice,
    level: u32,
}

impl BruteForce {
    fn of(map: &MultiResolutionMap, level: u32, surroundings: &Surroundings) -> Self {
        let view = map.view();
        let voxels = view.lists(level).flat_map(|list| list.iter());
        let voxels = voxels.filter(|voxel| {
            let center_m = map.lattice().center_m(*voxel, level);
            !surroundings.ignored.iter().any(|region| region.contains(center_m))
        });
        Self { voxels: voxels.collect(), lattice: *map.lattice(), level }
    }

    fn cells_per_m(&self) -> f64 {
        1.0 / self.lattice.resolution_m(self.level)
    }

    /// The least squared distance to a voxel, and the first voxel by key that has it.
    fn nearest(&self, center: [f64; 3]) -> Option<(f64, VoxelKey)> {
        let squared = |voxel: &VoxelKey| squared_distance(center, voxel.index().map(f64::from), 1.0);
        let all = self.voxels.iter().map(|voxel| (squared(voxel), *voxel));
        all.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    }

    fn spheres(&self, link: &Link) -> Vec<Sphere> {
        let of_point = |point: &Point| Sphere { center_m: point.xyz(), radius_m: 0.0 };
        let points = link.points.iter().filter(|_| link.padding_m > 0.0).map(of_point);
        link.spheres.iter().copied().chain(points).collect()
    }

    fn first_hit(&self, body: &Body, poses: &[LinkPose]) -> Option<Hit> {
        for (number, (link, pose)) in body.links().iter().zip(poses).enumerate() {
            let cells_from_link = CellsFromLink::of(pose, self.cells_per_m());
            let spheres = self.spheres(link);
            for (part, sphere) in spheres.iter().enumerate() {
                let radius = (f64::from(sphere.radius_m) + f64::from(link.padding_m)) * self.cells_per_m();
                let nearest = self.nearest(cells_from_link.cells(sphere.center_m.map(f64::from)));
                if let Some((_, voxel)) = nearest.filter(|(squared, _)| *squared <= radius * radius) {
                    return Some(Hit { link: number as u32, part: part as u32, met: Met::Voxel(voxel) });
                }
            }
            let lattice_from_points = pose.lattice_from_points(&self.lattice);
            for (part, point) in link.points.iter().enumerate().filter(|_| link.padding_m == 0.0) {
                let voxel = lattice_from_points.key(*point).map(|voxel| voxel.ancestor(self.level));
                if let Some(voxel) = voxel.filter(|voxel| self.voxels.contains(voxel)) {
                    let part = (spheres.len() + part) as u32;
                    return Some(Hit { link: number as u32, part, met: Met::Voxel(voxel) });
                }
            }
        }
        None
    }

    fn clearance(&self, body: &Body, poses: &[LinkPose], most_m: f32) -> Clearance {
        let mut nearest = (f64::from(most_m) * self.cells_per_m(), None);
        for (number, (link, pose)) in body.links().iter().zip(poses).enumerate() {
            let cells_from_link = CellsFromLink::of(pose, self.cells_per_m());
            let points = link.points.iter().map(|point| Sphere { center_m: point.xyz(), radius_m: 0.0 });
            for sphere in link.spheres.iter().copied().chain(points) {
                let radius = (f64::from(sphere.radius_m) + f64::from(link.padding_m)) * self.cells_per_m();
                let center = cells_from_link.cells(sphere.center_m.map(f64::from));
                let distance = self.nearest(center).map(|(squared, _)| (squared.sqrt() - radius).max(0.0));
                if let Some(distance) = distance.filter(|distance| *distance < nearest.0) {
                    nearest = (distance, Some(number as u32));
                }
            }
        }
        let distance_m = ((nearest.0 / self.cells_per_m()) as f32).min(most_m);
        Clearance { distance_m, link: nearest.1 }
    }
}

/// A change: voxels that go, and voxels that come.
type Exchange = (Vec<[i32; 3]>, Vec<[i32; 3]>);

fn voxels(indices: &[[i32; 3]]) -> VoxelSet {
    indices.iter().filter_map(|index| VoxelKey::new(*index)).collect()
}

fn exchange(map: &MultiResolutionMap, (removed, added): &Exchange) {
    map.committer().exchange(&voxels(removed), &voxels(added));
}

/// Few voxels here and there, dense ones in a corner, and a part of a wall.
fn indices() -> impl Strategy<Value = Vec<[i32; 3]>> {
    let anywhere = prop::collection::vec(prop::array::uniform3(-40i32..40), 0..12);
    let near = prop::collection::vec(prop::array::uniform3(-6i32..6), 0..40);
    let wall = (-20i32..20, 0..3usize, 0i32..14).prop_map(|(at, axis, size)| {
        let cells = (0..size * size).map(move |n| [n % size - 5, n / size - 7]);
        cells
            .map(|[a, b]| {
                let mut index = [a, b, at];
                index.swap(axis, 2);
                index
            })
            .collect::<Vec<_>>()
    });
    (anywhere, near, wall).prop_map(|(a, b, c)| [a, b, c].concat())
}

fn exchanges() -> impl Strategy<Value = Vec<Exchange>> {
    prop::collection::vec((indices(), indices()), 0..4)
}

/// Numbers of which many are whole eighths, so that spheres touch faces exactly.
fn number(most: i32) -> impl Strategy<Value = f32> {
    prop_oneof![
        (-8 * most..=8 * most).prop_map(|n| n as f32 / 8.0),
        (-1000i32..=1000).prop_map(move |n| n as f32 * most as f32 / 1000.0)
    ]
}

fn radius_m() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => (0i32..16).prop_map(|n| n as f32 / 8.0),
        4 => 0.0f32..1.5,
        1 => 0.0f32..12.0,
        1 => Just(0.0),
        1 => Just(1e-6),
    ]
}

fn link() -> impl Strategy<Value = Link> {
    let sphere = (prop::array::uniform3(number(1)), radius_m())
        .prop_map(|(center_m, radius_m)| Sphere { center_m, radius_m });
    let points = prop_oneof![3 => prop::collection::vec(prop::array::uniform3(number(1)), 0..4),
        1 => prop::collection::vec(prop::array::uniform3(number(3)), 60..90)];
    let padding = prop_oneof![2 => Just(0.0), 1 => 0.0f32..0.5, 1 => Just(0.25)];
    (prop::collection::vec(sphere, 0..12), points, padding).prop_map(|(spheres, points, padding_m)| Link {
        spheres,
        points: points.into_iter().map(Point::from).collect(),
        padding_m,
    })
}

fn pose() -> impl Strategy<Value = [f32; 7]> {
    let turned = prop::array::uniform4(-1.0f32..1.0).prop_map(|q| {
        let norm = q.iter().map(|c| c * c).sum::<f32>().sqrt();
        if norm > 0.1 { q.map(|c| c / norm) } else { [0.0, 0.0, 0.0, 1.0] }
    });
    let rotation = prop_oneof![1 => Just([0.0, 0.0, 0.0, 1.0]), 2 => turned];
    let far = prop::sample::select(vec![1e9f32, -524_288.0, 524_287.5, 3e38]);
    let coordinate = prop_oneof![30 => number(20).boxed(), 1 => far.boxed()];
    (prop::array::uniform3(coordinate), rotation).prop_map(|([x, y, z], [a, b, c, d])| [x, y, z, a, b, c, d])
}

fn near_pose() -> impl Strategy<Value = [f32; 7]> {
    (pose(), prop::array::uniform3(number(4))).prop_map(|([.., a, b, c, d], [x, y, z])| [x, y, z, a, b, c, d])
}

fn body_and_poses(poses: std::ops::Range<usize>) -> impl Strategy<Value = (Body, Vec<f32>)> {
    (prop::collection::vec(link(), 1..4), poses).prop_flat_map(|(links, count)| {
        let pose = prop_oneof![pose(), near_pose()];
        let poses = prop::collection::vec(pose, links.len() * count);
        (Just(Body::new(links).unwrap()), poses.prop_map(|poses| poses.concat()))
    })
}

fn surroundings() -> impl Strategy<Value = Surroundings> {
    let cuboid = (prop::array::uniform3(-6.0f64..3.0), prop::array::uniform3(0.0f64..6.0))
        .prop_map(|(low, size)| Region::cuboid(low, std::array::from_fn(|i| low[i] + size[i])).unwrap());
    let ball = (prop::array::uniform3(-5.0f64..5.0), 0.0f64..4.0)
        .prop_map(|(center_m, radius_m)| Region::ball(center_m, radius_m).unwrap());
    let regions = prop::collection::vec(prop_oneof![cuboid, ball], 1..3);
    prop_oneof![3 => Just(Vec::new()), 1 => regions].prop_map(|ignored| Surroundings { ignored })
}

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
        link in link(),
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
            let body = Body::new(vec![link]).unwrap();
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

/// The answer of a motion for which each step is looked at by brute force.
fn every_step(
    oracle: &BruteForce,
    question: &MotionQuestion<'_>,
    first: usize,
    length: usize,
) -> MotionAnswer {
    let step_m = question.step_m.map_or(0.5 / oracle.cells_per_m(), f64::from);
    let (mut first_hit, mut clearance_m) = (None, 4.0f32);
    for segment in 0..length - 1 {
        let poses = |n: usize| question.configurations.poses_of(first + n).iter().map(LinkPose::of);
        let motions: Vec<_> =
            poses(segment).zip(poses(segment + 1)).map(|(a, b)| LinkMotion::new(&a, &b)).collect();
        let extent_m = |link: &Link| {
            let norm = |c: [f32; 3]| c.iter().map(|c| f64::from(*c).powi(2)).sum::<f64>().sqrt();
            let spheres = link
                .spheres
                .iter()
                .map(|s| norm(s.center_m) + f64::from(s.radius_m) + f64::from(link.padding_m));
            let points = link.points.iter().map(|p| norm(p.xyz()) + f64::from(link.padding_m));
            spheres.chain(points).fold(0.0, f64::max)
        };
        let lengths =
            motions.iter().zip(question.body.links()).map(|(motion, link)| motion.length_m(extent_m(link)));
        let steps = (lengths.fold(0.0, f64::max) / step_m).ceil().max(1.0);
        for step in 0..=steps as usize {
            let poses: Vec<_> = motions.iter().map(|motion| motion.at(step as f64 / steps)).collect();
            clearance_m = clearance_m.min(oracle.clearance(question.body, &poses, 4.0).distance_m);
            if oracle.first_hit(question.body, &poses).is_some() {
                let share = (segment as f64 + step as f64 / steps) / (length - 1) as f64;
                first_hit = Some(share as f32);
                return MotionAnswer { first_hit, clearance_m: Some(0.0) };
            }
        }
    }
    MotionAnswer { first_hit, clearance_m: Some(clearance_m) }
}

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
