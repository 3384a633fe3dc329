//! Questions about the map of a workload, made with a copy of it, so that as many collide as is said.

use std::sync::Arc;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::fleet::error::FleetError;
use crate::measure::planning::{half_colliding, meets};
use crate::workload::Shots;
use crate::workload::bodies::arm::{self, Hand};
use crate::workload::bodies::cart;
use crate::workload::bodies::place::Surface;
use mrol_map::map::MultiResolutionMap;
use mrol_map::planning::{Body, NUMBERS_PER_POSE, Planner, Surroundings, Unknown};
use mrol_service::{CheckAs, MotionCheck, PointCloud, PoseCheck, QuestionScope, RayQuestion, RaysToward};

/// Messages that are asked in turn.
const MESSAGES: usize = 16;
/// Configurations of a message.
const CONFIGURATIONS: usize = 1000;
/// A controller's cycle: ways, and poses of each.
const ROLLOUTS: (usize, usize) = (1000, 56);
/// Rays of a message, about.
const RAYS: usize = 50_000;

/// Makes questions.
pub(crate) struct Questions {
    planner: Planner,
    surface: Surface,
    random: ChaCha8Rng,
}

impl Questions {
    /// Questions about a map.
    pub(crate) fn about(map: &Arc<MultiResolutionMap>, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let surface = Surface::of(map, &mut random);
        Self { planner: Planner::new(Arc::clone(map)), surface, random }
    }

    /// Messages of 1,000 configurations of an arm with eight links, of which so many collide.
    pub(crate) fn arms(&mut self, colliding: usize) -> Result<Vec<PoseCheck>, FleetError> {
        let body = Arc::new(arm::body(Hand::IsStiff).map_err(FleetError::failed)?);
        let wish = [MESSAGES * (CONFIGURATIONS - colliding), MESSAGES * colliding];
        let [free, hit] = self.sorted(&body, wish)?;
        let message = |n: usize| {
            let free = free.iter().skip(n).step_by(MESSAGES);
            let mut all: Vec<&Vec<f32>> = free.chain(hit.iter().skip(n).step_by(MESSAGES)).collect();
            all.shuffle(&mut self.random);
            check(&body, all.into_iter().flatten().copied().collect())
        };
        Ok((0..MESSAGES).map(message).collect())
    }

    /// Configurations of an arm that is free, and of one that is not, so many of each.
    fn sorted(&mut self, body: &Body, wish: [usize; 2]) -> Result<[Vec<Vec<f32>>; 2], FleetError> {
        let mut sorted = [Vec::new(), Vec::new()];
        for _ in 0..100 {
            let some = arm::configurations(Hand::IsStiff, &self.surface, 10_000, &mut self.random);
            let bits = meets(&self.planner, body, &some).map_err(FleetError::failed)?;
            for (n, one) in some.chunks_exact(Hand::IsStiff.links() * NUMBERS_PER_POSE).enumerate() {
                let kind = (bits[n / 64] >> (n % 64) & 1) as usize;
                if sorted[kind].len() < wish[kind] {
                    sorted[kind].push(one.to_vec());
                }
            }
            if (0..2).all(|kind| sorted[kind].len() == wish[kind]) {
                return Ok(sorted);
            }
        }
        Err(FleetError::failed("the map has no room for an arm, or nothing that it runs into"))
    }

    /// 256 motions of a body of 20 spheres, of which half collide.
    pub(crate) fn motions(&mut self) -> Result<MotionCheck, FleetError> {
        let body = cart::body().map_err(FleetError::failed)?;
        let made = half_colliding(&self.planner, &body, &self.surface, &mut self.random);
        let (configurations, _) = made.map_err(FleetError::failed)?;
        Ok(MotionCheck {
            asked: QuestionScope::default(),
            lengths: vec![2; configurations.len() / (2 * NUMBERS_PER_POSE)],
            configurations,
            body: Arc::new(body),
            step_m: None,
            clearance_max_m: None,
            surroundings: Surroundings::ALL_VOXELS,
        })
    }

    /// Cycles of a controller that samples: 56,000 poses of a body of four spheres each.
    pub(crate) fn cycles(&mut self) -> Result<Vec<PoseCheck>, FleetError> {
        let body = Arc::new(cart::footprint().map_err(FleetError::failed)?);
        let cycle = |_| check(&body, cart::rollouts(&self.surface, ROLLOUTS, &mut self.random));
        Ok((0..MESSAGES).map(cycle).collect())
    }
}

fn check(body: &Arc<Body>, configurations: Vec<f32>) -> PoseCheck {
    PoseCheck {
        asked: QuestionScope::default(),
        body: Arc::clone(body),
        configurations,
        surroundings: Surroundings::ALL_VOXELS,
        answer: CheckAs::Colliding,
    }
}

/// Rays in messages of some ten thousand, of one origin where all begin there.
pub(crate) fn rays(shots: &Shots, range_m: f64) -> Vec<RayQuestion> {
    let messages = shots.origins.chunks(RAYS).zip(shots.directions.chunks(RAYS));
    let message = |(origins, directions): (&[_], &[_])| {
        let has_one = origins.iter().all(|origin| *origin == origins[0]);
        RayQuestion {
            asked: QuestionScope::default(),
            origins: PointCloud::from(if has_one { origins[..1].to_vec() } else { origins.to_vec() }),
            toward: RaysToward::Directions { directions: PointCloud::from(directions.to_vec()), range_m },
            unknown: Unknown::Free,
        }
    };
    messages.map(message).collect()
}
