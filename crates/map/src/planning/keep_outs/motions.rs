//! Links along motions among shapes: met along the whole way, and not at steps alone, since a shape may be thinner than
//! any step.
//!
//! A link that is clear by d cannot meet a shape before one of its centers has moved by d, so it is looked at again
//! there (conservative advancement); where d is small, after a stride of [`Strides::met_m`]. Between two such places no
//! sphere's center gets nearer to a shape than its radius less half of that stride. Parts that are smaller than this
//! could go through a shape between them, so their ways from the one place to the other are tested as lines.

use super::figure::Solid;
use super::shapes::Shapes;
use crate::planning::body::{CellsFromLink, LinkMotion};
use crate::planning::effort::Effort;

/// The longest stride past a shape that is near, meters.
const STRIDE_MAX_M: f64 = 1e-3;
/// The stride past the least clearance so far, as a share of it.
const STRIDE_OF_CLEARANCE: f64 = 1.0 / 8.0;
/// What is taken off a distance before it is advanced by, meters.
const ROUNDING_M: f64 = 1e-7;

/// How far a link moves between two looks where something is near.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct Strides {
    /// Where the question is what is met, meters.
    met_m: f64,
    /// At most where the question is how near it gets, meters.
    clearance_max_m: f64,
}

/// What links move among.
#[derive(Debug)]
pub(in crate::planning) struct Among<'s, 'a> {
    /// The shapes.
    pub(in crate::planning) shapes: &'s Shapes<'a>,
    /// How exactly they are met.
    pub(in crate::planning) strides: Strides,
    /// What was done.
    pub(in crate::planning) effort: &'s Effort<'s>,
}

/// A link on its way between two configurations.
pub(in crate::planning) struct Way<'a> {
    /// The link.
    pub(in crate::planning) link: &'a Solid,
    /// How it moves.
    pub(in crate::planning) motion: &'a LinkMotion,
    /// How far a center of it moves at most, meters.
    pub(in crate::planning) length_m: f64,
}

impl Strides {
    /// Those of a question with steps of `step_m` in a map whose finest voxels have sides of `finest_m`: 1 mm or half
    /// such a voxel or the step, whichever is least, at every level.
    pub(in crate::planning) fn of(step_m: f64, finest_m: f64) -> Self {
        Self { met_m: step_m.min(finest_m / 2.0).min(STRIDE_MAX_M), clearance_max_m: step_m }
    }

    /// Past a shape that is `least_m` away.
    fn past_m(self, least_m: f64) -> f64 {
        (least_m * STRIDE_OF_CLEARANCE).min(self.clearance_max_m).max(self.met_m)
    }
}

impl Way<'_> {
    /// The share of the way, up to `until`, at which the link first meets a shape, no more than a stride late. None
    /// where it meets none.
    pub(in crate::planning) fn first_met(&self, among: &Among<'_, '_>, until: f64) -> Option<f64> {
        let Among { shapes, strides: Strides { met_m, .. }, effort } = *among;
        let (mut share, mut at) = (0.0, self.at(0.0));
        while effort.goes_on(1) {
            let far_m = (until - share) * self.length_m;
            // Where it is further than all of the way leads, nothing is met.
            let clear_m = self.link.distance_m(shapes, &at, far_m, effort)?;
            // What a point lies on the border of, or just beside it, is no distance away.
            if clear_m <= 0.0 && self.link.first_met(shapes, &at, effort).is_some() {
                return Some(share);
            }
            if share >= until {
                return None;
            }
            let next = self.after(share, (clear_m - ROUNDING_M).max(met_m)).min(until);
            let place = self.at(next);
            let thin = (met_m / 2.0, met_m);
            if clear_m <= met_m && self.link.crosses(shapes, [&at, &place], thin, effort) {
                return Some(next);
            }
            (share, at) = (next, place);
        }
        None
    }

    /// The least distance to a shape on the way, meters, where it is less than `least_m`: too much by half a stride at
    /// most.
    pub(in crate::planning) fn least_m(&self, among: &Among<'_, '_>, mut least_m: f64) -> f64 {
        let Among { shapes, strides, effort } = *among;
        let mut share = 0.0;
        while effort.goes_on(1) {
            let far_m = least_m + (1.0 - share) * self.length_m;
            // Whatever comes nearer is further than all of the way leads.
            let Some(distance_m) = self.link.distance_m(shapes, &self.at(share), far_m, effort) else {
                break;
            };
            least_m = least_m.min(distance_m);
            if share >= 1.0 {
                break;
            }
            let spare_m = (distance_m - least_m - ROUNDING_M).max(0.0);
            share = self.after(share, spare_m + strides.past_m(least_m)).min(1.0);
        }
        least_m
    }

    /// The share of the way at which a center can have moved so far.
    fn after(&self, share: f64, stride_m: f64) -> f64 {
        share + stride_m / self.length_m
    }

    fn at(&self, share: f64) -> CellsFromLink {
        CellsFromLink::of(&self.motion.at(share), 1.0)
    }
}
