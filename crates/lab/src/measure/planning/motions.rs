//! Motions of a cart.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::measure::stopwatch::Runs;
use crate::workload::bodies::cart;
use crate::workload::bodies::place::Surface;
use mrol_map::map::MultiResolutionMap;
use mrol_map::planning::{
    Body, Configurations, MotionQuestion, NUMBERS_PER_POSE, Planner, PlanningError, Surroundings,
};
use mrol_map::util::StopSignal;

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
pub(super) const MOTIONS: usize = 256;

/// How far each goes, meters.
const MOTION_M: f64 = 0.5;

/// Asks about 256 motions of half a meter of a body of 20 spheres near the map's surfaces, of which half collide, in
/// one question; `passes` times after one that is not timed.
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

/// 256 motions of half a meter of which half collide, and how many do. On some maps one kind is rare: then there are
/// fewer.
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
