//! Multiple starts: ascents from more guesses, where the one from the first guess ends badly.

use std::cmp::Reverse;

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::ascent::Ascent;
use super::ends::is_same_place;
use super::fit::Fit;
use super::overlap::Overlap;
use super::prior::PosePrior;
use super::sampled_scan::SampledScan;
use super::settings::AlignmentSettings;
use super::stages::{climb, finish};
use crate::geometry::Pose;
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;

/// Turns of the further guesses about each axis, degrees: the basin of a coarsest level's ascent is some 20 wide.
const TURNS_DEG: [f64; 4] = [-40.0, -20.0, 20.0, 40.0];
/// Number of the best ascents that are refined.
const FINISHED: usize = 2;

/// Ascends from the most promising of many guesses around the prior's, and returns where they ended, with the number of
/// look-ups that were made to choose them.
pub(super) fn ends(
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    prior: &PosePrior,
    settings: &AlignmentSettings,
) -> (Vec<Fit>, u64) {
    let coarse = map.settings().levels.saturating_sub(2);
    let shift_m = map.lattice().resolution_m(coarse);
    let resolution_m = map.lattice().resolution_m(0);
    let is_allowed = |guess: &Pose| prior.against(guess, resolution_m, settings).is_none();
    let guesses: Vec<Pose> = around(&prior.guess, shift_m).into_iter().filter(is_allowed).collect();
    let overlap = Overlap::new(map, &scan.sample, coarse, settings.lookup);
    let mut lookups = overlap.lookups() * guesses.len() as u64;
    let guesses = highest(guesses, &overlap, settings.multi_start.ascents, scan.stop);

    let climbed: Vec<_> =
        guesses.into_iter().map(|guess| climb(map, scan, guess, coarse, settings)).collect();
    lookups += climbed.iter().map(|ascent| ascent.lookups).sum::<u64>();
    let finest = Overlap::new(map, &scan.sample, 0, settings.lookup);
    let is_same = |a: &Pose, b: &Pose| is_same_place(a, b, resolution_m);
    let mut ends: Vec<Pose> = Vec::new();
    for end in highest(climbed.iter().map(|ascent| ascent.pose).collect(), &finest, climbed.len(), scan.stop)
    {
        if ends.len() < FINISHED && !ends.iter().any(|known| is_same(known, &end)) {
            ends.push(end);
        }
    }

    // After a small motion the guess itself may be the best of all: the coarse levels lead away from it.
    ends.push(prior.guess);
    let found = ends.into_iter().map(|end| finish(map, scan, Ascent::from(end), settings)).collect();
    (found, lookups)
}

/// `guess` shifted along and turned about the map's axes, each alone and together.
fn around(guess: &Pose, shift_m: f64) -> Vec<Pose> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let shifts = axes.into_iter().flat_map(|axis| [axis * shift_m, axis * -shift_m]);
    let shifts: Vec<_> = std::iter::once(Vector3::zeros()).chain(shifts).collect();
    let turns = axes.into_iter().flat_map(|axis| TURNS_DEG.map(|degrees| axis * degrees.to_radians()));
    let turns = std::iter::once(Vector3::zeros()).chain(turns);
    let moved = |turn: Vector3<f64>| {
        let rotation = UnitQuaternion::from_scaled_axis(turn) * guess.rotation;
        shifts
            .iter()
            .map(move |shift| Pose::from_parts(Translation3::from(*shift) * guess.translation, rotation))
    };
    turns.flat_map(moved).collect()
}

/// The `count` poses of highest overlap, the highest first; of equals the first.
fn highest(poses: Vec<Pose>, overlap: &Overlap<'_>, count: usize, stop: StopSignal<'_>) -> Vec<Pose> {
    let heights = overlap.at(&poses, stop);
    let mut ranked: Vec<usize> = (0..poses.len()).collect();
    ranked.sort_by_key(|&i| Reverse(heights[i]));
    ranked.into_iter().take(count).map(|i| poses[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::pose_difference;

    #[test]
    fn guesses_surround_the_first_one() {
        let guess = Pose::translation(1.0, 2.0, 3.0);
        let poses = around(&guess, 0.5);
        assert_eq!(poses.len(), 7 * 13);
        assert_eq!(poses[0], guess);
        assert!(poses.iter().all(|pose| pose_difference(pose, &guess).0 < 0.51));
    }
}
