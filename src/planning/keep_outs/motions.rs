//! Links along motions among shapes: steps are skipped by the distance to the shapes, as they are by that to voxels.

use super::{Shapes, Solid};
use crate::planning::path::LinkMotion;
use crate::planning::placement::CellsFromLink;

/// What is taken off a distance before steps are skipped by it, meters.
const ROUNDING_M: f64 = 1e-7;

/// A link on its way between two configurations.
pub(in crate::planning) struct Way<'a> {
    /// The link.
    pub(in crate::planning) link: &'a Solid,
    /// How it moves.
    pub(in crate::planning) motion: &'a LinkMotion,
    /// How many steps it takes.
    pub(in crate::planning) steps: u64,
    /// How far a center of it moves in a step at most, meters.
    pub(in crate::planning) per_step_m: f64,
}

impl Way<'_> {
    /// The first step from `first` on and before `end` at which the link meets a shape; `end` where there is none.
    pub(in crate::planning) fn first_met(&self, shapes: &Shapes<'_>, first: u64, end: u64) -> u64 {
        let mut step = first;
        while step < end {
            match self.clear_by(shapes, step, (end - step) as f64 * self.per_step_m) {
                Some(by_m) => step += self.steps_without(by_m),
                None => return step,
            }
        }
        end
    }

    /// The least distance to a shape at any step, meters, where it is less than `least_m`.
    pub(in crate::planning) fn least_m(&self, shapes: &Shapes<'_>, mut least_m: f64) -> f64 {
        let mut step = 0;
        while step <= self.steps {
            let far_m = least_m + (self.steps - step) as f64 * self.per_step_m;
            match self.link.distance_m(shapes, &self.at(step), far_m) {
                // Whatever comes nearer is further than all steps lead.
                None => break,
                Some(distance_m) if distance_m > least_m => step += self.steps_without(distance_m - least_m),
                Some(distance_m) => (least_m, step) = (distance_m, step + 1),
            }
        }
        least_m
    }

    /// How far the link is from shapes at a step at least, up to `most_m`; none where it meets one.
    fn clear_by(&self, shapes: &Shapes<'_>, step: u64, most_m: f64) -> Option<f64> {
        let at = self.at(step);
        match self.link.distance_m(shapes, &at, most_m) {
            None => Some(f64::INFINITY),
            Some(distance_m) if distance_m > 0.0 => Some(distance_m),
            // On the border of what a point lies in, or in it.
            Some(_) => self.link.first_met(shapes, &at).is_none().then_some(0.0),
        }
    }

    fn at(&self, step: u64) -> CellsFromLink {
        CellsFromLink::of(&self.motion.at(step as f64 / self.steps as f64), 1.0)
    }

    /// Steps to the next one at which what is so far away can be reached.
    fn steps_without(&self, clear_m: f64) -> u64 {
        let steps = (clear_m - ROUNDING_M) / self.per_step_m;
        if steps >= 1.0 { steps.min(self.steps as f64 + 1.0) as u64 } else { 1 }
    }
}
