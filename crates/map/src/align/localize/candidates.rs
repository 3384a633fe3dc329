//! Candidates: the places that a search found, refined by alignment and ranked.

use super::answer::Candidate;
use super::basins::Basin;
use super::dilated::DilatedLevels;
use super::sample::SearchSample;
use super::settings::LocalizationSettings;
use super::visibility::blocked_share;
use crate::align::agreement::Rays;
use crate::align::rivals::Contest;
use crate::align::sampled_scan::SampledScan;
use crate::align::sequential::evaluate_at;
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
    pub(super) levels: &'a DilatedLevels,
    pub(super) sample: &'a SearchSample,
    pub(super) settings: &'a LocalizationSettings,
    pub(super) alignment: &'a AlignmentSettings,
    pub(super) stop: StopSignal<'a>,
}

impl Refinement<'_> {
    /// The distinct candidates that the places lead to, best first. All are refined with some of the scan's points,
    /// then the best `wish` with all of them. Once stopped, the remaining places are judged where they are, with a few
    /// thousand look-ups each.
    pub(super) fn candidates(&self, places: &[Basin], wish: usize) -> Vec<Candidate> {
        let thinned = volumetric_sample_until(self.points, THINNED, self.alignment.seed, self.stop).points;
        let mut candidates: Vec<Candidate> =
            places.iter().map(|place| self.first_at(&thinned, place)).collect();
        rank(&mut candidates);
        let mut candidates = self.distinct(candidates);
        for candidate in candidates.iter_mut().take(wish) {
            let refined = self.at(self.points, &candidate.map_from_sensor(), candidate.search_overlap);
            // A refinement that was stopped half-way is meaningless.
            if self.stop.is_stopped() {
                break;
            }
            *candidate = refined;
        }
        rank(&mut candidates);
        self.distinct(candidates)
    }

    /// The candidate that a place leads to, refined with the thinned points; the unrefined place once stopped.
    fn first_at(&self, thinned: &[Point], place: &Basin) -> Candidate {
        let (pose, search_overlap) = (place.map_from_sensor, self.share(place.score));
        if !self.stop.is_stopped() {
            let candidate = self.at(thinned, &pose, search_overlap);
            if !self.stop.is_stopped() {
                return candidate;
            }
        }
        let alignment = evaluate_at(self.map, thinned, &pose, self.alignment);
        let blocked = blocked_share(self.levels, self.sample, &pose, StopSignal::NEVER);
        Candidate { alignment, search_overlap, blocked, margin: None }
    }

    fn share(&self, score: u16) -> f64 {
        f64::from(score) / self.sample.points.len().max(1) as f64
    }

    fn at(&self, points: &[Point], guess: &Pose, search_overlap: f64) -> Candidate {
        let alignment = self.refined(points, guess);
        let blocked = blocked_share(self.levels, self.sample, &alignment.map_from_sensor, self.stop);
        Candidate { alignment, search_overlap, blocked, margin: None }
    }

    /// Aligns `points` from a place. There is no restart from other guesses: the search has covered them.
    fn refined(&self, points: &[Point], guess: &Pose) -> Alignment {
        let scan = SampledScan::new(points, self.map.lattice(), self.alignment, self.stop);
        let ascent = climb(self.map, &scan, *guess, self.map.settings().levels - 1, self.alignment);
        finish(self.map, &scan, ascent, self.alignment)
    }

    /// Puts the candidate first that rays contradict least, with the verdict on it.
    pub(super) fn ask_rays(&self, candidates: &mut [Candidate]) {
        if candidates.is_empty() {
            return;
        }
        let scan = SampledScan::new(self.points, self.map.lattice(), self.alignment, self.stop);
        let rays = Rays::of(self.map, &scan);
        let contest = Contest { map: self.map, scan: &scan, rays: &rays, settings: self.alignment };
        let places = candidates.iter().map(|candidate| candidate.alignment.clone()).collect();
        let alignment = contest.decide_among(places);
        let is_it = |candidate: &Candidate| candidate.map_from_sensor() == alignment.map_from_sensor;
        let best = candidates.iter().position(is_it).unwrap_or(0);
        candidates[best].alignment = alignment;
        candidates[..=best].rotate_right(1);
    }

    /// Removes candidates that are the same place as a better one, which takes over their search score.
    fn distinct(&self, ranked: Vec<Candidate>) -> Vec<Candidate> {
        let radius_m = self.settings.basin_voxels * self.levels.finest().resolution_m();
        let mut distinct: Vec<Candidate> = Vec::with_capacity(ranked.len());
        for candidate in ranked {
            let same = distinct.iter_mut().find(|better| {
                let (meters, degrees) =
                    pose_difference(&better.map_from_sensor(), &candidate.map_from_sensor());
                meters < radius_m && degrees < self.settings.basin_deg
            });
            match same {
                Some(better) => better.search_overlap = better.search_overlap.max(candidate.search_overlap),
                None => distinct.push(candidate),
            }
        }
        distinct
    }
}

/// Sorts candidates by descending fit; the sort is stable.
fn rank(candidates: &mut [Candidate]) {
    candidates.sort_by(|a, b| b.fit().total_cmp(&a.fit()));
}

pub(super) fn set_margins(ranked: &mut [Candidate]) {
    let fits: Vec<f64> = ranked.iter().map(Candidate::fit).collect();
    for (place, candidate) in ranked.iter_mut().enumerate() {
        let other = if place == 0 { fits.get(1) } else { fits.first() };
        candidate.margin = other.map(|other| fits[place] - other);
    }
}
