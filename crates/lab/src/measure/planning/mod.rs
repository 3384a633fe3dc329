//! Measurement of planners' questions: an arm at poses, a body of points, motions, and what all that costs a map that
//! changes.

mod changing;
mod points;

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::peer_file;
use super::stopwatch::Runs;
use crate::workload::bodies::arm::{self, Hand};
use crate::workload::bodies::cart;
use crate::workload::bodies::place::Surface;
pub use changing::{Changing, between_insertions};
use mrol_map::map::MultiResolutionMap;
use mrol_map::planning::{
    Body, Configurations, MotionQuestion, NUMBERS_PER_POSE, Planner, PlanningError, PoseQuestion,
    Surroundings,
};
use mrol_map::util::StopSignal;
pub use points::{PointBody, point_body};

/// What an arm's poses cost.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmPoses {
    /// Links of the arm.
    pub links: usize,
    /// Poses that were asked about.
    pub poses: usize,
    /// Those at which the arm meets a voxel.
    pub colliding: usize,
    /// The first pass, for which the fields are made; nanoseconds a pose.
    pub first_ns: f64,
    /// Passes after it.
    pub runs: Runs,
    /// Bytes of the fields after it.
    pub field_bytes: usize,
}

/// What motions cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Motions {
    /// Motions that were asked about.
    pub motions: usize,
    /// Those on which the body meets a voxel.
    pub colliding: usize,
    /// Nanoseconds a motion.
    pub runs: Runs,
}

/// Motions of which half collide.
const MOTIONS: usize = 256;
/// How far each goes, meters.
const MOTION_M: f64 = 0.5;

/// Asks about an arm of 59 spheres in 11 links, or in 8 with a stiff hand, at `poses` random configurations within a meter of the map's surfaces, a bit each;
/// `passes` times after the first.
///
/// # Errors
/// When the map's voxels are too small for the arm.
pub fn arm_poses(
    map: &Arc<MultiResolutionMap>,
    has_stiff_hand: bool,
    poses: usize,
    passes: usize,
    seed: u64,
) -> Result<ArmPoses, PlanningError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let hand = if has_stiff_hand { Hand::IsStiff } else { Hand::Moves };
    let arm = arm::body(hand)?;
    let numbers = arm::configurations(hand, &Surface::of(map, &mut random), poses, &mut random);
    let planner = Planner::new(Arc::clone(map));
    let (mut first, mut runs) = (Runs::default(), Runs::default());
    let bits = first.time(poses, || meets(&planner, &arm, &numbers))?;
    for _ in 0..passes {
        runs.time(poses, || meets(&planner, &arm, &numbers))?;
    }
    let colliding = bits.iter().map(|word| word.count_ones() as usize).sum();
    let field_bytes = planner.field_bytes();
    Ok(ArmPoses { links: hand.links(), poses, colliding, first_ns: first.median(), runs, field_bytes })
}

/// Writes the map's voxels and the poses of [`arm_poses`] for programs of other libraries: the spheres of each, x y z and
/// radius, and 0 where one meets a voxel.
///
/// # Errors
/// When the map's voxels are too small for the arm, or the file cannot be written.
pub fn write_arms(
    path: &Path,
    map: &Arc<MultiResolutionMap>,
    poses: usize,
    seed: u64,
) -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let arm = arm::body(Hand::Moves)?;
    let numbers = arm::configurations(Hand::Moves, &Surface::of(map, &mut random), poses, &mut random);
    let bits = meets(&Planner::new(Arc::clone(map)), &arm, &numbers)?;
    let arms = numbers.chunks_exact(Hand::Moves.links() * NUMBERS_PER_POSE).enumerate();
    let queries: Vec<_> = arms
        .map(|(n, poses)| {
            let is_met = bits[n / 64] >> (n % 64) & 1 == 1;
            (arm::spheres_at(&arm, poses), if is_met { 0.0 } else { f32::INFINITY })
        })
        .collect();
    Ok(peer_file::write(path, map, 0.0, queries.into_iter())?)
}

/// A bit for each configuration, by a view of its own.
pub(crate) fn meets(planner: &Planner, body: &Body, numbers: &[f32]) -> Result<Vec<u64>, PlanningError> {
    let configurations = Configurations::new(numbers, body.links().len())?;
    let surroundings = &Surroundings::ALL_VOXELS;
    let question = PoseQuestion { body, configurations, level: 0, surroundings };
    Ok(planner.view().bodies_meet(&question, StopSignal::NEVER)?.unwrap_or_default())
}

/// Asks about 256 motions of half a meter of a body of 20 spheres near the map's surfaces, of which half collide, in one
/// question; `passes` times after one that is not timed.
///
/// # Errors
/// When the map's voxels are too small for the body.
pub fn motions(map: &Arc<MultiResolutionMap>, passes: usize, seed: u64) -> Result<Motions, PlanningError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (body, planner) = (cart::body()?, Planner::new(Arc::clone(map)));
    let surface = Surface::of(map, &mut random);
    let (numbers, colliding) = half_colliding(&planner, &body, &surface, &mut random)?;
    let motions = numbers.len() / (2 * NUMBERS_PER_POSE);
    let mut runs = Runs::default();
    ask(&planner, &body, &numbers)?;
    for _ in 0..passes {
        runs.time(motions, || ask(&planner, &body, &numbers))?;
    }
    Ok(Motions { motions, colliding, runs })
}

/// 256 motions of half a meter of which half collide, and how many do. On some maps one kind is rare: then there are fewer.
pub(crate) fn half_colliding(
    planner: &Planner,
    body: &Body,
    surface: &Surface,
    random: &mut ChaCha8Rng,
) -> Result<(Vec<f32>, usize), PlanningError> {
    let (mut free, mut hit) = (Vec::new(), Vec::new());
    for _ in 0..100 * MOTIONS {
        if free.len() == MOTIONS / 2 && hit.len() == MOTIONS / 2 {
            break;
        }
        let ends = cart::motion(surface, MOTION_M, random);
        let kind = if ask(planner, body, &ends)?.contains(&true) { &mut hit } else { &mut free };
        if kind.len() < MOTIONS / 2 {
            kind.push(ends);
        }
    }
    let colliding = hit.len();
    Ok((free.into_iter().chain(hit).flatten().collect(), colliding))
}

/// True for each motion on which the body meets a voxel.
fn ask(planner: &Planner, body: &Body, numbers: &[f32]) -> Result<Vec<bool>, PlanningError> {
    let configurations = Configurations::new(numbers, 1)?;
    let question = MotionQuestion {
        body,
        configurations,
        lengths: &vec![2; configurations.len() / 2],
        step_m: None,
        clearance_max_m: None,
        level: 0,
        surroundings: &Surroundings::ALL_VOXELS,
    };
    let answers = planner.view().check_motions(&question, StopSignal::NEVER)?.unwrap_or_default();
    Ok(answers.iter().map(|answer| !answer.is_free()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Room, Site, Workload};
    use mrol_map::map::MapSettings;

    fn map_of(workload: Workload) -> Arc<MultiResolutionMap> {
        Arc::new(workload.map(MapSettings::new(workload.resolution_m(), 6)).unwrap())
    }

    #[test]
    fn arms_and_motions_collide_now_and_then() {
        for workload in [Workload::Room(Room), Workload::Site(Site::of(100_000, 1))] {
            let map = map_of(workload);
            let arms = arm_poses(&map, false, 300, 1, 1).unwrap();
            assert!((30..270).contains(&arms.colliding), "{arms:?}");
            assert!(arms.field_bytes > 10_000 && arms.runs.ns_per_item().len() == 1);
            let motions = motions(&map, 1, 1).unwrap();
            assert_eq!((motions.motions, motions.colliding), (MOTIONS, MOTIONS / 2));
        }
    }

    #[test]
    fn a_body_of_points_and_a_map_that_changes_are_measured() {
        let map = map_of(Workload::Room(Room));
        let points = point_body(&map, 50, 1, 1).unwrap();
        assert_eq!((points.poses, points.points), (50, 500));
        let changing = between_insertions(Workload::Room(Room), MapSettings::new(0.05, 6), 3, 1).unwrap();
        assert_eq!((changing.first_checks_ms.len(), changing.with_planner_ms.len()), (3, 3));
        assert!(changing.changed_voxels > 0.0 && changing.between_ns > 0.0);
    }
}
