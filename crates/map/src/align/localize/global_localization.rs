//! Global localization: the composing functions.

use super::answer::{Localization, LocalizationError};
use super::basins::Basins;
use super::bound::Bounds;
use super::candidates::Refinement;
use super::dilated::DilatedLevels;
use super::orientation::Orientations;
use super::query::LocalizationQuery;
use super::rotation::RotationLattice;
use super::sample::SearchSample;
use super::search::Search;
use super::settings::LocalizationSettings;
use super::supervision::{Supervision, Unbuilt, check};
use super::verdict::verdict_on;
use crate::align::extent::within_extent;
use crate::align::settings::AlignmentSettings;
use crate::geometry::Point;
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;
use crate::voxel::sample_bytes_max;

/// Finds where in the map a scan was taken, with no guess.
///
/// `points` are in the sensor frame, meters; those farther away than any two places of a map are left out. One revision
/// of the map is searched; the refinement at the end reads the map as it is then. The search runs on one thread, and
/// the same input gives the same answer.
///
/// # Errors
/// When the map is empty, has nothing near the search box, or needs more memory than the settings allow; when no point
/// is left.
pub fn localize(
    map: &MultiResolutionMap,
    points: &[Point],
    query: &LocalizationQuery,
    settings: &LocalizationSettings,
    alignment: &AlignmentSettings,
) -> Result<Localization, LocalizationError> {
    let alone = &mut Supervision {
        stop: StopSignal::NEVER,
        search_stop: StopSignal::NEVER,
        progress: &mut |_| (),
        reserve: &mut |_| true,
    };
    localize_supervised(map, points, query, settings, alignment, alone)
}

/// [`localize`] with stop signals, progress reports and a memory budget. Every phase checks the stop signal every few
/// milliseconds. Once stopped, the answer is the best so far, refined in what is left of the time: it is cut short, and
/// never accepted.
///
/// # Errors
/// As for [`localize`]; when memory is refused.
pub fn localize_supervised(
    map: &MultiResolutionMap,
    points: &[Point],
    query: &LocalizationQuery,
    settings: &LocalizationSettings,
    alignment: &AlignmentSettings,
    supervision: &mut Supervision<'_>,
) -> Result<Localization, LocalizationError> {
    match search_and_refine(map, points, query, settings, alignment, supervision) {
        Ok(found) => Ok(found),
        Err(Unbuilt::Stopped) => Ok(Localization::cut_short_at_once(map.content_version())),
        Err(Unbuilt::Refused(error)) => Err(error),
    }
}

fn search_and_refine(
    map: &MultiResolutionMap,
    points: &[Point],
    query: &LocalizationQuery,
    settings: &LocalizationSettings,
    alignment: &AlignmentSettings,
    supervision: &mut Supervision<'_>,
) -> Result<Localization, Unbuilt> {
    let (stop, extent_m) = (supervision.stop, map.lattice().extent_m());
    // Memory for a copy of the points, and for thinning them.
    supervision.take(size_of_val(points) + sample_bytes_max(points.len()))?;
    let points: &[Point] = &within_extent(points, extent_m, stop);
    check(stop)?;
    if points.is_empty() {
        return Err(LocalizationError::NothingInRange { extent_m }.into());
    }

    // 1) Take a few hundred points, even over the surfaces that the scan shows.
    let sample = SearchSample::of(points, settings.search_points, query.seed, stop);

    // 2) Dilate one revision of the map, at levels coarser than its own where needed.
    let levels = DilatedLevels::of(map, &sample, query.search_box, settings, supervision)?;

    // 3) Consider all rotations about the direction of gravity where it is known, else those that bring surfaces of the
    // scan parallel to surfaces of the map.
    let orientations = Orientations::of(points, &levels, query.gravity.as_ref(), settings, stop)?;

    // 4) Bound and divide cells of poses, the most promising first.
    let side_m = levels.finest().resolution_m();
    let turn_rad = settings.arc_share * side_m / sample.range_m.max(side_m);
    let rotations = RotationLattice::new(turn_rad, orientations.tilt_max_rad, settings.halvings + 1);
    let bounds = Bounds::new(&levels, &sample, &orientations.families, rotations);
    let basins =
        Basins::new(settings.basin_voxels * side_m, settings.basin_deg.to_radians(), settings.basins_max);
    let found = Search::new(&bounds, settings, basins, supervision).run();

    // 5) Refine the places found by alignment, rank them by rays, and say whether the best is to be believed.
    let judged =
        Refinement { map, points, side_m, settings, alignment, stop }.judged(&found.places, query.candidates);
    let cut_short = !found.complete || stop.is_stopped();
    let (verdict, reason) = verdict_on(judged.as_ref().map(|judged| &judged.best), cut_short, settings);
    let (mut candidates, rivals) =
        judged.map(|judged| (judged.candidates, judged.best.rivals)).unwrap_or_default();
    candidates.truncate(query.candidates);
    Ok(Localization {
        verdict,
        reason,
        candidates,
        rivals,
        exhaustive: !cut_short && orientations.all,
        cut_short,
        cells: found.cells,
        version: levels.version,
    })
}
