//! Global localisation: where in a map a scan was taken, with no guess (the paper's \[8\]).
//!
//! [`localize`] is branch and bound over all poses. The overlap of every pose in a cell of poses is bounded from above
//! by the overlap of the cell's centre with a map that is dilated by as much as points move within the cell
//! (`bound`); cells that cannot hold a place worth knowing are left out, the others divided, down to cells from which
//! an alignment finds its way. That is the modern form of what \[8\] does on the levels of this map: a coarse level is
//! such a bound only after dilation, since a point's cube of translations spans up to 2 x 2 x 2 of its voxels and
//! rotations widen that by the arc at the point's range.
//!
//! Reading order: `field` is a dilated level, `dilated` the levels of one revision, `orientation` and `rotation` the rotations,
//! `bound` the bounds, `search` the search; `candidates`, `sight` and `verdict` say what its places are worth.

mod answer;
mod basins;
mod bound;
mod candidates;
mod dilated;
mod field;
mod normals;
mod orientation;
mod query;
mod rotation;
mod sample;
mod search;
mod settings;
mod sight;
mod verdict;

pub use answer::{Candidate, Localization, LocalizationError, SearchProgress};
pub use query::{Gravity, LocalizationQuery, LocalizationQueryError, MAP_DOWN, SearchBox};
pub use settings::LocalizationSettings;

use std::ops::ControlFlow;

use super::AlignmentSettings;
use crate::geometry::Point;
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;
use basins::Basins;
use bound::Bounds;
use candidates::Refinement;
use dilated::DilatedLevels;
use orientation::Orientations;
use rotation::RotationLattice;
use sample::SearchSample;
use search::Search;
use verdict::verdict_on;

/// Finds where in the map a scan was taken, with no guess.
///
/// `points` are in the sensor frame; those farther away than any two places of a map are left out. `watch` is told of the progress every few hundred cells
/// and stops the search by breaking; the answer is then the best so far, refined. One revision of the map is searched; the
/// refinement at the end sees the map as it is then. One thread does it all, and the same input gives the same answer
/// unless `watch` breaks.
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
    watch: &mut dyn FnMut(&SearchProgress) -> ControlFlow<()>,
) -> Result<Localization, LocalizationError> {
    localize_until(map, points, query, settings, alignment, watch, StopSignal::NEVER)
}

/// The same, which ends soon after nobody wants the answer: what it returns then means nothing.
///
/// # Errors
/// As for [`localize`].
pub fn localize_until(
    map: &MultiResolutionMap,
    points: &[Point],
    query: &LocalizationQuery,
    settings: &LocalizationSettings,
    alignment: &AlignmentSettings,
    watch: &mut dyn FnMut(&SearchProgress) -> ControlFlow<()>,
    stop: StopSignal<'_>,
) -> Result<Localization, LocalizationError> {
    let reach_m = map.lattice().reach_m();
    let in_reach = |point: &Point| point.to_f64().coords.norm() <= reach_m;
    let points: &[Point] = &points.iter().copied().filter(in_reach).collect::<Vec<_>>();
    if points.is_empty() {
        return Err(LocalizationError::NothingInReach { reach_m });
    }

    // 1) Take a few hundred points, even over the surfaces that the scan shows.
    let sample = SearchSample::of(points, settings.search_points, query.seed);

    // 2) Dilate one revision of the map, at levels coarser than its own where needed.
    let levels = DilatedLevels::of(map, &sample, query.search_box, settings)?;

    // 3) Turn about the way down where it is known, else about what the scan's surfaces and the map's could share.
    let orientations = Orientations::of(points, &levels, query.gravity.as_ref(), settings);

    // 4) Bound and divide cells of poses, the most promising first.
    let side_m = levels.finest().resolution_m();
    let turn_rad = settings.arc_share * side_m / sample.range_m.max(side_m);
    let rotations = RotationLattice::new(turn_rad, orientations.tilt_max_rad, settings.halvings + 1);
    let bounds = Bounds::new(&levels, &sample, &orientations.families, rotations);
    let basins =
        Basins::new(settings.basin_voxels * side_m, settings.basin_deg.to_radians(), settings.basins_max);
    let watch = &mut |progress: &SearchProgress| match stop.is_stopped() {
        true => ControlFlow::Break(()),
        false => watch(progress),
    };
    let found = Search::new(&bounds, settings, basins, watch).run();

    // 5) Refine the places found by alignment, and rank them.
    let refinement = Refinement { map, points, levels: &levels, sample: &sample, settings, alignment, stop };
    let mut candidates = refinement.candidates(&found.places, query.candidates);

    // 6) Say whether the best of them stands out.
    let (verdict, reason) = verdict_on(&candidates, !found.complete, settings);
    candidates.truncate(query.candidates);
    Ok(Localization {
        verdict,
        reason,
        candidates,
        exhaustive: found.complete && orientations.all,
        cut_short: !found.complete,
        cells: found.cells,
        revision: levels.revision,
    })
}
