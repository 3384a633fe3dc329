//! Alignment of a scan to the map (paper III-A, III-B), from a guess. Without a guess: [`localize`].
//!
//! [`align`] reads like the paper's summary: a volumetric sample, an ascent on overlap at each level from coarse to
//! fine, and a sub-voxel stage. The last is the paper's ascent with all points, or a refinement on the surfaces of the
//! map.
//!
//! *Overlap* is the share of all the scan's points that fall in occupied voxels of level 0 by the exact set, before the
//! scan is added ([`overlap`](fn@overlap)). [`Verdict`] says whether to believe the pose. It is *undetermined* where the
//! scan would fit as well at poses nearby: what it sees of the map, such as one blank wall, leaves a direction of the
//! pose open ([`PoseInformation`]).

mod ascent;
mod extent;
mod free_space;
mod gravity;
mod information;
pub mod localize;
mod multi_start;
mod overlap;
mod prior;
mod refine;
mod settings;
mod slide;
mod verdict;

pub use free_space::{Contradiction, FreeSpaceSettings};
pub use information::{Direction, PoseInformation};
pub use overlap::{OccupiedVoxels, level_overlaps, overlap};
pub use prior::{PoseCovariance, PoseCovarianceError, PosePrior};
pub use settings::{
    AlignmentSettings, AlignmentSettingsError, Method, MultiStartSettings, RefinementSettings,
};
pub use verdict::{Alignment, Verdict};

use crate::geometry::{Point, Pose, pose_difference};
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;
use crate::voxel::volumetric_sample_until;
use ascent::{Ascent, Steps};
use extent::within_extent;
use information::root_mean_square_range_m;
use overlap::{Overlap, level_overlaps_until};
use refine::{refine, surface_fit};
use slide::Slide;
use verdict::Fit;

/// A scan and the samples that its alignment reads.
#[derive(Debug)]
struct SampledScan<'a> {
    /// All points of the scan: sensor frame, meters, finite.
    points: &'a [Point],
    /// Volumetric sample of about 1000 points, for the ascent (paper III-A).
    sample: Vec<Point>,
    /// Volumetric sample of about 5000 points, for the refinement and the verdict.
    surface_sample: Vec<Point>,
    /// Ends the alignment early; every climb checks it.
    stop: StopSignal<'a>,
}

impl<'a> SampledScan<'a> {
    /// 1) Take a volumetric sample of points: of those that can be on a map that reaches as far as `extent_m`.
    fn new(points: &'a [Point], extent_m: f64, settings: &AlignmentSettings, stop: StopSignal<'a>) -> Self {
        let near = within_extent(points, extent_m, stop);
        let wish = settings.refinement.sample_points.max(settings.sample_points);
        let fine = volumetric_sample_until(&near, wish, settings.seed, stop);
        let sample =
            volumetric_sample_until(&fine.points, settings.sample_points, settings.seed, stop).points;
        Self { points, sample, surface_sample: fine.points, stop }
    }
}

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

/// 2) - 4) Align iteratively at each level, coarse to fine, each from where the coarser one ended.
fn climb(
    voxels: &dyn OccupiedVoxels,
    scan: &SampledScan<'_>,
    guess: Pose,
    coarsest: u32,
    settings: &AlignmentSettings,
) -> Ascent {
    let mut ascent = Ascent::from(guess);
    for level in (0..=coarsest).rev() {
        let overlap = Overlap::new(voxels, &scan.sample, level, settings.lookup);
        let steps = Steps::of_level(level, voxels.lattice(), settings);
        ascent.climb(&overlap, steps, settings.iterations_per_level_max, scan.stop);
    }
    ascent
}

/// 5) Sub-voxel alignment: with all points and small steps.
fn climb_sub_voxel(
    voxels: &dyn OccupiedVoxels,
    scan: &SampledScan<'_>,
    ascent: &mut Ascent,
    settings: &AlignmentSettings,
) {
    let overlap = Overlap::new(voxels, scan.points, 0, settings.lookup);
    for halvings in 0..=settings.sub_voxel_halvings {
        let steps = Steps::sub_voxel(voxels.lattice(), settings).halved(halvings);
        ascent.climb(&overlap, steps, settings.sub_voxel_iterations_max, scan.stop);
    }
}

/// 5) as in the paper, or by [`refine`] in its place where the map keeps moments; and a verdict.
fn finish(
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    mut ascent: Ascent,
    settings: &AlignmentSettings,
) -> Alignment {
    let climbed = ascent.pose;
    match settings.method {
        Method::Refined if map.settings().moments => {
            let refined = refine(map, &scan.surface_sample, &climbed, &settings.refinement, scan.stop);
            ascent.pose = refined.map_from_sensor;
            ascent.iterations += refined.iterations;
        }
        Method::Refined | Method::Overlap => climb_sub_voxel(map, scan, &mut ascent, settings),
    }
    let (meters, degrees) = pose_difference(&climbed, &ascent.pose);
    fit(
        map,
        scan,
        ascent,
        meters + degrees.to_radians() * root_mean_square_range_m(&scan.surface_sample),
        settings,
    )
    .judged(map, settings)
}

/// Measures how a scan fits at the end of an ascent, which the last stage moved by `refined_by_m`.
fn fit(
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    ascent: Ascent,
    refined_by_m: f64,
    settings: &AlignmentSettings,
) -> Fit {
    let keeps_moments = map.settings().moments;
    Fit {
        map_from_sensor: ascent.pose,
        refined_by_m,
        slide: if keeps_moments { None } else { Slide::of(map, scan, &ascent.pose, settings) },
        level_overlaps: level_overlaps_until(map, scan.points, &ascent.pose, scan.stop),
        surfaces: surface_fit(map, &scan.surface_sample, &ascent.pose, &settings.refinement, scan.stop),
        iterations: ascent.iterations,
        lookups: ascent.lookups,
    }
}

#[cfg(test)]
mod tests;
