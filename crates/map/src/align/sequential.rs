//! Sequential alignment (paper III-B): the composing functions.

use super::agreement::Rays;
use super::ascent::Ascent;
use super::fit::Fit;
use super::multi_start;
use super::overlap::OccupiedVoxels;
use super::prior::PosePrior;
use super::rivals::Contest;
use super::sampled_scan::SampledScan;
use super::settings::AlignmentSettings;
use super::stages::{climb, climb_sub_voxel, finish};
use super::verdict::{Alignment, Verdict};
use crate::geometry::{Point, Pose, pose_difference};
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;

/// Finds the pose of a scan by sequential multi-resolution alignment (paper III-B), from the guess `guess`
/// (map_from_sensor).
///
/// `points` are in the sensor frame, meters, and finite. The map may change meanwhile: each step reads one revision of
/// it, and a step with more than 262,144 points may read several.
pub fn align(
    map: &MultiResolutionMap,
    points: &[Point],
    guess: &Pose,
    settings: &AlignmentSettings,
) -> Alignment {
    align_until(map, points, &(*guess).into(), settings, StopSignal::NEVER)
}

/// [`align`] with all that is known of the pose, under a stop signal.
///
/// Only poses that the prior allows are looked at and accepted. Once `stop` is set, it returns early, and the result is
/// meaningless.
pub fn align_until(
    map: &MultiResolutionMap,
    points: &[Point],
    prior: &PosePrior,
    settings: &AlignmentSettings,
    stop: StopSignal<'_>,
) -> Alignment {
    let scan = &SampledScan::new(points, map.lattice(), settings, stop);
    let guess = prior.leveled_guess();
    let prior = &PosePrior { guess, ..*prior };

    // 1) - 5) from the guess. The coarse levels find what is far from it, and pull away from what is near: both ends
    //    are looked at.
    let coarsest = map.settings().levels - 1;
    let from_coarse = climb(map, scan, guess, coarsest, settings);
    let mut ends = vec![finish(map, scan, from_coarse, settings)];
    let from_fine = climb(map, scan, guess, FINE.min(coarsest), settings);
    let (meters, degrees) = pose_difference(&from_fine.pose, &from_coarse.pose);
    if meters > map.lattice().resolution_m(0) || degrees > SAME_END_DEG {
        ends.push(finish(map, scan, from_fine, settings));
    }

    // From other guesses around it, where that ended badly.
    let is_doubtful = ends[0].is_doubtful(&guess, map, settings) && !stop.is_stopped();
    let wants_more_starts = is_doubtful && settings.multi_start.ascents == 0;
    let mut lookups = 0;
    if is_doubtful && !wants_more_starts {
        let (found, of_guesses) = multi_start::ends(map, scan, prior, settings);
        lookups += of_guesses;
        ends.extend(found);
    }

    // Which of the ends to believe, and whether.
    let rays = &Rays::of(map, scan);
    let found = Contest { map, scan, rays, settings }.decide(ends, prior);
    let wants_more_starts = wants_more_starts || found.wants_more_starts;
    let lookups = lookups + found.lookups;
    Alignment { wants_more_starts, lookups, ..found }.within_prior(prior, map, settings)
}

/// The coarsest level of the ascent that the coarse ones cannot pull away from its guess.
const FINE: u32 = 1;
/// Ascents that end nearer to each other than r_0 and so many degrees are refined as one.
const SAME_END_DEG: f64 = 1.0;

/// Measures how a scan fits the map at the pose `map_from_sensor`, without moving it: accepted, since the caller
/// says so. Once `stop` is set, the result is meaningless.
pub fn evaluate_at(
    map: &MultiResolutionMap,
    points: &[Point],
    map_from_sensor: &Pose,
    settings: &AlignmentSettings,
    stop: StopSignal<'_>,
) -> Alignment {
    let scan = SampledScan::new(points, map.lattice(), settings, stop);
    let fit = Fit::of(map, &scan, Ascent::from(*map_from_sensor), 0.0, settings);
    fit.told(Verdict::Accepted, "the caller's word".into())
}

/// Runs the paper's ascent alone (III-B, steps 1 to 5) on any structure of occupied voxels, and returns the pose where
/// it ends, without a verdict.
pub fn ascend(
    voxels: &dyn OccupiedVoxels,
    points: &[Point],
    guess: &Pose,
    settings: &AlignmentSettings,
) -> Pose {
    let scan = SampledScan::new(points, voxels.lattice(), settings, StopSignal::NEVER);
    let mut ascent = climb(voxels, &scan, *guess, voxels.lattice().levels() - 1, settings);
    climb_sub_voxel(voxels, &scan, &mut ascent, settings);
    ascent.pose
}
