//! Multiple starts: ascents from more guesses, where the one from the first guess ends badly.

use std::cmp::Reverse;

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::ascent::Ascent;
use super::overlap::Overlap;
use super::prior::PosePrior;
use super::sampled_scan::SampledScan;
use super::settings::AlignmentSettings;
use super::stages::{climb, finish};
use super::verdict::{Alignment, Verdict};
use crate::geometry::{Pose, pose_difference};
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;

/// Turns of the further guesses about each axis, degrees: the basin of a coarsest level's ascent is some 20 wide.
const TURNS_DEG: [f64; 4] = [-40.0, -20.0, 20.0, 40.0];
/// Poses that differ by less than this many r_0 and less than [`SAME_DEG`] count as the same.
const SAME_VOXELS: f64 = 4.0;
const SAME_DEG: f64 = 5.0;
/// Number of the best ascents that are refined and judged.
const FINISHED: usize = 2;

/// Ascends from the most promising of many guesses around the prior's, and returns the better of their result and `first`.
///
/// The verdict is ambiguous where a different pose fits about equally well.
pub(super) fn align(
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    prior: &PosePrior,
    first: Alignment,
    settings: &AlignmentSettings,
) -> Alignment {
    let coarse = map.settings().levels.saturating_sub(2);
    let shift_m = map.lattice().resolution_m(coarse);
    let resolution_m = map.lattice().resolution_m(0);
    let is_allowed = |guess: &Pose| prior.against(guess, resolution_m, settings).is_none();
    let guesses: Vec<Pose> = around(&prior.guess, shift_m).into_iter().filter(is_allowed).collect();
    let overlap = Overlap::new(map, &scan.sample, coarse, settings.lookup);
    let mut lookups = first.lookups + overlap.lookups() * guesses.len() as u64;
    let guesses = highest(guesses, &overlap, settings.multi_start.ascents, scan.stop);

    let climbed: Vec<_> =
        guesses.into_iter().map(|guess| climb(map, scan, guess, coarse, settings)).collect();
    lookups += climbed.iter().map(|ascent| ascent.lookups).sum::<u64>();
    let finest = Overlap::new(map, &scan.sample, 0, settings.lookup);
    let is_same = |a: &Pose, b: &Pose| {
        let (meters, degrees) = pose_difference(a, b);
        meters < SAME_VOXELS * map.lattice().resolution_m(0) && degrees < SAME_DEG
    };
    let mut ends: Vec<Pose> = Vec::new();
    for end in highest(climbed.iter().map(|ascent| ascent.pose).collect(), &finest, climbed.len(), scan.stop)
    {
        if ends.len() < FINISHED && !ends.iter().any(|known| is_same(known, &end)) {
            ends.push(end);
        }
    }

    // After a small motion the guess itself may be the best of all: the coarse levels lead away from it.
    ends.push(prior.guess);
    let mut found: Vec<_> =
        ends.into_iter().map(|end| finish(map, scan, Ascent::from(end), settings)).collect();
    lookups += found.iter().map(|found| found.lookups).sum::<u64>();
    let is_accepted = |found: &Alignment| found.verdict == Verdict::Accepted;
    let better = |a: Alignment, b: &Alignment| match is_same(&a.map_from_sensor, &b.map_from_sensor) {
        true if is_accepted(b) && !is_accepted(&a) => b.clone(),
        false if b.fitness > a.fitness => b.clone(),
        _ => a,
    };
    let best = Alignment { lookups, ..found.iter().fold(first.clone(), better) };
    found.push(first);
    // Where starts far apart end at one pose, that pose is determined, however far the refinement moved it.
    let ended_there =
        found.iter().filter(|found| is_same(&found.map_from_sensor, &best.map_from_sensor)).count();
    let best = match best.verdict {
        Verdict::Undetermined if best.undetermined.is_empty() && ended_there > 1 => {
            let reason = format!("{ended_there} starts ended there, at overlap {:.3}", best.overlap());
            best.but(Verdict::Accepted, reason)
        }
        _ => best,
    };
    let as_good = found.iter().find(|other| {
        !is_same(&other.map_from_sensor, &best.map_from_sensor)
            && other.fitness >= settings.multi_start.ambiguous_fitness * best.fitness
    });
    match as_good {
        Some(other) if is_accepted(&best) => {
            let (meters, degrees) = pose_difference(&other.map_from_sensor, &best.map_from_sensor);
            let reason = format!(
                "a pose {meters:.2} m and {degrees:.1} deg away fits about as well: {:.3} against {:.3}",
                other.fitness, best.fitness
            );
            best.but(Verdict::Ambiguous, reason)
        }
        _ => best,
    }
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

    #[test]
    fn guesses_surround_the_first_one() {
        let guess = Pose::translation(1.0, 2.0, 3.0);
        let poses = around(&guess, 0.5);
        assert_eq!(poses.len(), 7 * 13);
        assert_eq!(poses[0], guess);
        assert!(poses.iter().all(|pose| pose_difference(pose, &guess).0 < 0.51));
    }
}
