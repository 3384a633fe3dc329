//! Candidates: the places that a search found, refined by alignment and ranked by rays.

use super::answer::Candidate;
use super::basins::Basin;
use super::settings::LocalizationSettings;
use crate::align::agreement::Rays;
use crate::align::ascent::Ascent;
use crate::align::ends::{End, Ends};
use crate::align::fit::Fit;
use crate::align::rivals::Contest;
use crate::align::sampled_scan::SampledScan;
use crate::align::settings::AlignmentSettings;
use crate::align::stages::{climb, finish};
use crate::align::verdict::Alignment;
use crate::geometry::{Point, Pose, pose_difference};
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;
use crate::voxel::volumetric_sample_until;

/// Number of points that a place is first refined with, before the best are refined with all.
const THINNED: usize = 3000;

/// Inputs of the refinement of places.
pub(super) struct Refinement<'a> {
    pub(super) map: &'a MultiResolutionMap,
    pub(super) points: &'a [Point],
    /// Side of the finest voxels of the search, meters.
    pub(super) side_m: f64,
    pub(super) settings: &'a LocalizationSettings,
    pub(super) alignment: &'a AlignmentSettings,
    pub(super) stop: StopSignal<'a>,
}

/// The candidates of a search, the best first, and the alignment there with its verdict.
pub(super) struct Judged {
    pub(super) candidates: Vec<Candidate>,
    pub(super) best: Alignment,
}

impl Refinement<'_> {
    /// The distinct candidates that the places lead to; none without a place. All are refined with some of the scan's
    /// points and looked at by rays, then the best `wish` refined with all points. Once stopped, the remaining places
    /// are taken where they are, with a few thousand look-ups each, and ranked by overlap.
    pub(super) fn judged(&self, places: &[Basin], wish: usize) -> Option<Judged> {
        if places.is_empty() {
            return None;
        }
        let (map, settings) = (self.map, self.alignment);
        let thinned = volumetric_sample_until(self.points, THINNED, settings.seed, self.stop).points;
        let (scan, thinned) = (self.sampled(self.points, self.stop), self.sampled(&thinned, self.stop));
        let rays = Rays::of(map, &scan);
        let contest = Contest { map, scan: &scan, rays: &rays, settings };
        let rank = |fits: Vec<Fit>| contest.rank(fits, |a, b| self.is_same_place(a, b));

        let fits = places.iter().map(|place| self.first_at(&thinned, &place.map_from_sensor)).collect();
        let ranked = rank(fits).all.into_iter().map(|end| end.fit).enumerate();
        let refined = ranked.map(|(k, fit)| match k < wish {
            true => self.refined(&scan, &fit.map_from_sensor).unwrap_or(fit),
            false => fit,
        });
        let mut ends = rank(refined.collect());
        let best = contest.decide_among(&mut ends);
        Some(Judged { candidates: candidates(&ends, &best.map_from_sensor), best })
    }

    fn sampled<'a>(&self, points: &'a [Point], stop: StopSignal<'a>) -> SampledScan<'a> {
        SampledScan::new(points, self.map.lattice(), self.alignment, stop)
    }

    /// How the thinned points fit where they lead from a place; at the place itself once stopped.
    fn first_at(&self, thinned: &SampledScan<'_>, place: &Pose) -> Fit {
        self.refined(thinned, place).unwrap_or_else(|| {
            let unstopped = self.sampled(thinned.points, StopSignal::NEVER);
            Fit::of(self.map, &unstopped, Ascent::from(*place), 0.0, self.alignment)
        })
    }

    /// Aligns a scan from a place; none once stopped, since half of it is meaningless. There is no restart from other
    /// guesses: the search has covered them.
    fn refined(&self, scan: &SampledScan<'_>, guess: &Pose) -> Option<Fit> {
        if self.stop.is_stopped() {
            return None;
        }
        let ascent = climb(self.map, scan, *guess, self.map.settings().levels - 1, self.alignment);
        let fit = finish(self.map, scan, ascent, self.alignment);
        (!self.stop.is_stopped()).then_some(fit)
    }

    /// True of poses that the search takes as one place.
    fn is_same_place(&self, a: &Pose, b: &Pose) -> bool {
        let (meters, degrees) = pose_difference(a, b);
        meters < self.settings.basin_voxels * self.side_m && degrees < self.settings.basin_deg
    }
}

/// The candidates at the ends, in their order, but `best` first.
fn candidates(ends: &Ends<'_>, best: &Pose) -> Vec<Candidate> {
    let of_end = |end: &End| Candidate {
        map_from_sensor: end.fit.map_from_sensor,
        overlap: end.fit.overlap(),
        inliers: end.fit.inliers,
        agreement: Some(end.agreement).filter(|agreement| agreement.is_asked()),
    };
    let mut candidates: Vec<Candidate> = ends.all.iter().map(of_end).collect();
    if let Some(place) = candidates.iter().position(|candidate| candidate.map_from_sensor == *best) {
        candidates[..=place].rotate_right(1);
    }
    candidates
}
