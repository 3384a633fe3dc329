//! An arm at poses.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::measure::peer_file;
use crate::measure::stopwatch::Runs;
use crate::workload::bodies::arm::{self, Hand};
use crate::workload::bodies::place::Surface;
use mrol_map::map::MultiResolutionMap;
use mrol_map::planning::{
    Body, Configurations, NUMBERS_PER_POSE, Planner, PlanningError, PoseQuestion, Surroundings,
};
use mrol_map::util::StopSignal;

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

/// Asks about an arm of 59 spheres in 11 links, or in 8 with a stiff hand, at `poses` random configurations within a
/// meter of the map's surfaces, a bit each; `passes` times after the first.
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

/// Writes the map's voxels and the poses of [`arm_poses`] for programs of other libraries: the spheres of each, x y z
/// and radius, and 0 where one meets a voxel.
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
