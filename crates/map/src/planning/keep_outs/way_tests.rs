//! Motions among keep-outs, which are met along the whole way, against looks at every few millimeters or less; and how
//! often the stop signal is looked at.

use std::cell::Cell;
use std::sync::Arc;

use proptest::prelude::*;

use super::tests::{BruteForce, RESOLUTION_M, body_and_poses, map, map_of, poses_of};
use crate::geometry::Point;
use crate::map::test_shapes::shape;
use crate::map::{KeepOutShape, MultiResolutionMap, Prism, Region};
use crate::planning::body::{LinkMotion, LinkPose};
use crate::planning::effort::WORK_PER_STOP_CHECK;
use crate::planning::*;
use crate::util::StopSignal;

const NEVER: StopSignal<'static> = StopSignal::NEVER;
/// The stride past what is near: that of every question here, whose steps are longer.
const STRIDE_M: f64 = 1e-3;

/// A motion of one segment, as a body is asked about it.
struct Asked<'a> {
    map: &'a Arc<MultiResolutionMap>,
    body: &'a Body,
    numbers: &'a [f32],
    step_m: Option<f32>,
    level: u32,
}

/// What is found by a look at every so many meters.
struct Sampled {
    /// The first share at which a part is deeper in a shape than the most that may be missed.
    first_deep: Option<f64>,
    least_m: f64,
    length_m: f64,
    every_m: f64,
}

impl Asked<'_> {
    fn answer(&self, keep_outs: bool) -> MotionAnswer {
        let configurations = Configurations::new(self.numbers, self.body.links().len()).unwrap();
        let question = MotionQuestion {
            body: self.body,
            configurations,
            lengths: &[2],
            step_m: self.step_m,
            clearance_max_m: Some(6.0),
            level: self.level,
            surroundings: &Surroundings::ALL_VOXELS,
        };
        let planner = Planner::new(Arc::clone(self.map));
        let view = if keep_outs { planner.view().with_keep_outs() } else { planner.view() };
        view.check_motions(&question, NEVER).unwrap().unwrap()[0]
    }

    fn motions(&self) -> Vec<LinkMotion> {
        let (from, to) = self.numbers.split_at(self.numbers.len() / 2);
        poses_of(from).iter().zip(&poses_of(to)).map(|(from, to)| LinkMotion::new(from, to)).collect()
    }

    fn sampled(&self, every_m: f64) -> Sampled {
        let (motions, brute) = (self.motions(), BruteForce(self.map.keep_outs()));
        let in_cells = self.body.in_cells(1.0 / RESOLUTION_M).unwrap();
        let far = motions.iter().zip(&in_cells.links).map(|(motion, link)| motion.length_m(link.extent_m));
        let length_m = far.fold(0.0, f64::max);
        let looks = (length_m / every_m).ceil().max(1.0) as u64;
        let (mut first_deep, mut least_m) = (None, f64::INFINITY);
        for look in 0..=looks {
            let share = look as f64 / looks as f64;
            let poses: Vec<_> = motions.iter().map(|motion| motion.at(share)).collect();
            let depth_m = brute.depth_m(self.body, &poses);
            least_m = least_m.min((-depth_m).max(0.0));
            if depth_m > STRIDE_M / 2.0 + 1e-6 || depth_m >= 0.0 && self.is_bare_point_in(&brute, &poses) {
                first_deep = Some(share);
                break;
            }
        }
        Sampled { first_deep, least_m, length_m, every_m }
    }

    fn is_bare_point_in(&self, brute: &BruteForce, poses: &[LinkPose]) -> bool {
        let bare = |link: &Link| match link.padding_m {
            0.0 => Link { spheres: Vec::new(), ..link.clone() },
            _ => Link { points: Vec::new(), spheres: Vec::new(), ..link.clone() },
        };
        let bare = Body::new(self.body.links().iter().map(bare).collect());
        bare.is_ok_and(|bare| brute.first_hit(&bare, poses).is_some())
    }

    /// Compares the answer with what is found at every `every_m`.
    fn check(&self, every_m: f64) -> Result<(), TestCaseError> {
        let (of_voxels, told, sampled) = (self.answer(false), self.answer(true), self.sampled(every_m));
        let share = |meters: f64| meters / sampled.length_m.max(1e-9) + 1e-6;
        if let Some(deep) = sampled.first_deep {
            let first = told.first_hit.expect("a shape is in the way");
            prop_assert!(f64::from(first) <= deep + share(STRIDE_M), "at {first}, and deep at {deep}");
        }
        match (told.first_hit, of_voxels.first_hit) {
            (Some(first), voxel) if voxel != Some(first) => {
                prop_assert!(voxel.is_none_or(|voxel| first < voxel));
                let poses: Vec<_> = self.motions().iter().map(|motion| motion.at(f64::from(first))).collect();
                let distances = BruteForce(self.map.keep_outs()).distances_m(self.body, &poses);
                let least_m = distances.into_iter().fold(f64::INFINITY, f64::min);
                prop_assert!(least_m <= STRIDE_M + 1e-4, "told to be met {least_m} m away");
            }
            (first, voxel) => prop_assert_eq!(first, voxel),
        }
        let (told_m, voxels_m) = (f64::from(told.clearance_m.unwrap()), of_voxels.clearance_m.unwrap());
        if told.first_hit.is_none() {
            let least_m = sampled.least_m.min(f64::from(voxels_m));
            let stride_m = (least_m / 8.0).max(STRIDE_M);
            prop_assert!(
                told_m <= least_m + stride_m / 2.0 * 1.1 + 1e-5,
                "told {told_m}, and it is {least_m}"
            );
            prop_assert!(
                told_m >= least_m - sampled.every_m / 2.0 - 1e-5,
                "told {told_m}, and it is {least_m}"
            );
        } else {
            prop_assert_eq!(told_m, 0.0);
        }
        Ok(())
    }
}

/// Something as thin as a sheet, or without any thickness, turned anyhow, near the origin.
fn sheet() -> impl Strategy<Value = KeepOutShape> {
    let thickness = prop_oneof![Just(0.0), 0.0..0.02f64];
    let place = || prop::array::uniform3(-1.0..1.0f64);
    let cuboid = (place(), thickness, 0usize..3).prop_map(|(center, thickness, axis)| {
        let half = |of: usize| if of == axis { thickness / 2.0 } else { 3.0 };
        let min = std::array::from_fn(|of| center[of] - half(of));
        let max = std::array::from_fn(|of| center[of] + half(of));
        KeepOutShape::of_region(Region::cuboid(min, max).unwrap()).unwrap()
    });
    let prism = (place(), place(), 0.001..0.02f64).prop_map(|([x, y, z], [a, b, _], thickness)| {
        let norm = a.hypot(b).max(1e-3);
        let (along, across) =
            ([3.0 * a / norm, 3.0 * b / norm], [-b / norm * thickness, a / norm * thickness]);
        let corner = |s: f64, t: f64| [x + s * along[0] + t * across[0], y + s * along[1] + t * across[1]];
        let corners = [corner(-1.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        KeepOutShape::Prism(Prism::new(&corners, [z - 2.0, z + 2.0]).unwrap())
    });
    prop_oneof![cuboid, prism]
}

/// A small ball or a bare point off its link's origin, and two poses within a few meters.
fn small_body_and_ends() -> impl Strategy<Value = (Body, Vec<f32>)> {
    let part = (prop::array::uniform3(-0.5f32..0.5), prop_oneof![Just(None), (0.0f32..0.1).prop_map(Some)]);
    let body = part.prop_map(|(center_m, radius_m)| {
        let link = match radius_m {
            Some(radius_m) => Link { spheres: vec![Sphere { center_m, radius_m }], ..Link::default() },
            None => Link { points: vec![Point::from(center_m)], ..Link::default() },
        };
        Body::new(vec![link]).unwrap()
    });
    let turn = prop::array::uniform4(-1.0f32..1.0).prop_filter_map("a rotation", |q| {
        let norm = q.iter().map(|c| c * c).sum::<f32>().sqrt();
        (norm > 0.1).then(|| q.map(|c| c / norm))
    });
    let pose = (prop::array::uniform3(-1.5f32..1.5), turn)
        .prop_map(|([x, y, z], [a, b, c, d])| [x, y, z, a, b, c, d]);
    (body, prop::collection::vec(pose, 2)).prop_map(|(body, ends)| (body, ends.concat()))
}

fn step_m() -> impl Strategy<Value = Option<f32>> {
    prop::sample::select(vec![None, Some(0.3), Some(1000.0)])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn shapes_are_met_along_the_whole_way((body, numbers) in body_and_poses(), map in map(), step_m in step_m(), level in 0u32..3) {
        for ends in numbers.chunks(28) {
            Asked { map: &map, body: &body, numbers: ends, step_m, level }.check(0.02)?;
        }
    }

    #[test]
    fn no_sheet_is_too_thin_for_a_long_step(
        (body, numbers) in small_body_and_ends(), sheet in sheet(), other in shape(), step_m in step_m(), level in 0u32..3,
    ) {
        let map = map_of(Vec::new(), vec![sheet, other]);
        Asked { map: &map, body: &body, numbers: &numbers, step_m, level }.check(0.0005)?;
    }

    #[test]
    fn whatever_goes_from_one_side_of_a_sheet_to_the_other_meets_it(
        (body, mut numbers) in small_body_and_ends(), thickness in prop_oneof![Just(0.0), 0.0..1e-4f64], step_m in step_m(), level in 0u32..3,
    ) {
        let sheet = Region::cuboid([-100.0, -100.0, 0.0], [100.0, 100.0, thickness]).unwrap();
        let map = map_of(Vec::new(), vec![KeepOutShape::of_region(sheet).unwrap()]);
        // All of the body is above the sheet at first, and below it at last.
        (numbers[2], numbers[9]) = (3.0 + numbers[2], -2.0 - numbers[9].abs());
        let asked = Asked { map: &map, body: &body, numbers: &numbers, step_m, level };
        let told = asked.answer(true);
        prop_assert!(!told.is_free() && told.clearance_m == Some(0.0));
        let poses: Vec<_> = asked.motions().iter().map(|motion| motion.at(f64::from(told.first_hit.unwrap()))).collect();
        let depth_m = BruteForce(map.keep_outs()).depth_m(&body, &poses);
        prop_assert!(depth_m >= -1.1 * STRIDE_M, "met {depth_m} m deep");
    }
}

/// A plate of so many spheres at the height of 0, and prisms of 64 corners around it that it does not meet.
fn plate_among_prisms(spheres: usize, prisms: usize) -> (Body, Arc<MultiResolutionMap>) {
    let ring = |radius: f64, i: usize| {
        let (sin, cos) = (i as f64 * std::f64::consts::TAU / 32.0).sin_cos();
        [radius * cos, radius * sin]
    };
    // A horseshoe: all around the plate, so that no box tells that it is not met.
    let horseshoe = |n: usize| {
        let radius = 30.0 + n as f64;
        let outer = (0..32).map(|i| ring(radius, i));
        let corners: Vec<_> = outer.chain((0..32).rev().map(|i| ring(radius - 0.5, i))).collect();
        KeepOutShape::Prism(Prism::new(&corners, [-1.0, 1.0]).unwrap())
    };
    let sphere = |i: usize| Sphere {
        center_m: [(i % 100) as f32 * 0.01, (i / 100) as f32 * 0.01, 0.0],
        radius_m: 0.01,
    };
    let link = Link { spheres: (0..spheres).map(sphere).collect(), ..Link::default() };
    (Body::new(vec![link]).unwrap(), map_of(Vec::new(), (0..prisms).map(horseshoe).collect()))
}

/// Asks a question until so many looks were made at the signal: true where it was answered, and how many were made.
fn asked_until(looks_max: u64, ask: &dyn Fn(StopSignal<'_>) -> bool) -> (bool, u64) {
    let looks = Cell::new(0u64);
    let is_over = || looks.replace(looks.get() + 1) >= looks_max;
    let is_answered = ask(StopSignal::when(&is_over));
    (is_answered, looks.get())
}

#[test]
fn questions_among_shapes_look_at_the_signal_in_proportion_to_their_work_and_end_when_stopped() {
    for (spheres, prisms, count) in [(1000, 20, 2), (50, 200, 4), (1, 1, 600)] {
        let (body, map) = plate_among_prisms(spheres, prisms);
        let planner = Planner::new(map);
        let place = |i: usize| [(i % 7) as f32 * 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let numbers: Vec<f32> = (0..count).flat_map(place).collect();
        let (configurations, lengths) = (Configurations::new(&numbers, 1).unwrap(), vec![2; count / 2]);
        let surroundings = &Surroundings::ALL_VOXELS;
        let poses = PoseQuestion { body: &body, configurations, level: 0, surroundings };
        let (step_m, clearance_max_m) = (Some(0.1), Some(32.0));
        let motions = MotionQuestion {
            body: &body,
            configurations,
            lengths: &lengths,
            step_m,
            clearance_max_m,
            level: 0,
            surroundings,
        };
        let view = planner.view().with_keep_outs();
        let asks: [&dyn Fn(StopSignal<'_>) -> bool; 3] = [
            &|stop| view.first_hits(&poses, stop).unwrap().is_some(),
            &|stop| view.clearances(&poses, 32.0, stop).unwrap().is_some(),
            &|stop| view.check_motions(&motions, stop).unwrap().is_some(),
        ];
        for (number, ask) in asks.into_iter().enumerate() {
            // What the field lacks is made the first time, in rounds with looks of their own.
            ask(StopSignal::NEVER);
            let (is_answered, looks) = asked_until(u64::MAX, ask);
            assert!(is_answered);
            // What is away from the ball around the link is tested once for it, and not for each sphere.
            let tests = if number == 0 { prisms * count } else { (spheres * prisms * count) * 65 };
            let a_look = tests as u64 / looks;
            assert!(a_look <= u64::from(WORK_PER_STOP_CHECK), "question {number}: {a_look} tests a look");
            for looks_max in [0, 1, looks / 2, looks - 1] {
                let (is_answered, made) = asked_until(looks_max, ask);
                assert!(!is_answered && made <= looks_max + 2, "{number}: {made} looks after {looks_max}");
            }
        }
    }
}
