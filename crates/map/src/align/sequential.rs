//! Sequential alignment (paper III-B): the composing functions.

use super::ascent::Ascent;
use super::free_space::Contradiction;
use super::multi_start;
use super::overlap::OccupiedVoxels;
use super::prior::PosePrior;
use super::sampled_scan::SampledScan;
use super::settings::AlignmentSettings;
use super::stages::{climb, climb_sub_voxel, finish, fit};
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
    let scan = SampledScan::new(points, map.lattice().extent_m(), settings, stop);
    let guess = prior.leveled_guess();
    let ascent = climb(map, &scan, guess, map.settings().levels - 1, settings);
    let found = finish(map, &scan, ascent, settings);
    let found = match found.is_doubtful(&guess, map, settings) && !stop.is_stopped() {
        true if settings.multi_start.ascents == 0 => Alignment { wants_more_starts: true, ..found },
        true => multi_start::align(map, &scan, &PosePrior { guess, ..*prior }, found, settings),
        false => found,
    };
    let found = found.within_max_correction(&guess, map, settings).within_prior(prior, map, settings);
    uncontradicted(found, map, &scan, &guess, settings)
}

/// The alignment, refused where it lies far from its guess and free space contradicts it.
fn uncontradicted(
    found: Alignment,
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    guess: &Pose,
    settings: &AlignmentSettings,
) -> Alignment {
    let (pose, free_space) = (&found.map_from_sensor, &settings.free_space);
    let correction = pose_difference(guess, pose);
    let is_asked = free_space.is_asked_at(correction, map.lattice().resolution_m(0));
    if found.verdict != Verdict::Accepted || !is_asked {
        return found;
    }
    let contradiction = Contradiction::of(map, &scan.surface_sample, pose, free_space, scan.stop);
    let contradiction = contradiction.with_overlaps(&found.level_overlaps);
    let found = Alignment { contradiction, ..found };
    match contradiction.reason(&settings.free_space) {
        Some(reason) => found.but(Verdict::Contradicted, reason),
        None => found,
    }
}

/// Judges how a scan fits the map at the pose `map_from_sensor`, without moving it.
pub fn evaluate_at(
    map: &MultiResolutionMap,
    points: &[Point],
    map_from_sensor: &Pose,
    settings: &AlignmentSettings,
) -> Alignment {
    evaluate_at_until(map, points, map_from_sensor, settings, StopSignal::NEVER)
}

/// [`evaluate_at`] under a stop signal. Once `stop` is set, the result is meaningless.
pub fn evaluate_at_until(
    map: &MultiResolutionMap,
    points: &[Point],
    map_from_sensor: &Pose,
    settings: &AlignmentSettings,
    stop: StopSignal<'_>,
) -> Alignment {
    let scan = SampledScan::new(points, map.lattice().extent_m(), settings, stop);
    fit(map, &scan, Ascent::from(*map_from_sensor), 0.0, settings).judged(map, settings)
}

/// Runs the paper's ascent alone (III-B, steps 1 to 5) on any structure of occupied voxels, and returns the pose where
/// it ends, without a verdict.
pub fn ascend(
    voxels: &dyn OccupiedVoxels,
    points: &[Point],
    guess: &Pose,
    settings: &AlignmentSettings,
) -> Pose {
    let scan = SampledScan::new(points, voxels.lattice().extent_m(), settings, StopSignal::NEVER);
    let mut ascent = climb(voxels, &scan, *guess, voxels.lattice().levels() - 1, settings);
    climb_sub_voxel(voxels, &scan, &mut ascent, settings);
    ascent.pose
}
