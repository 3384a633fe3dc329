//! Fits: how a scan lies to what the map holds at a pose, before anything says whether to believe it.

use super::ascent::Ascent;
use super::information::{Direction, PoseInformation};
use super::overlap::level_overlaps_until;
use super::refine::surface_fit;
use super::sampled_scan::SampledScan;
use super::settings::AlignmentSettings;
use super::slide::Slide;
use super::verdict::{Alignment, Verdict};
use crate::geometry::{Pose, pose_difference};
use crate::map::MultiResolutionMap;

/// How a scan fits the map at a pose.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) map_from_sensor: Pose,
    /// As [`Alignment::level_overlaps`].
    pub(super) level_overlaps: Vec<f64>,
    /// As [`Alignment::inliers`].
    pub(super) inliers: f64,
    /// As [`Alignment::fitness`].
    pub(super) fitness: f64,
    /// As [`Alignment::information`].
    pub(super) information: PoseInformation,
    /// As [`Alignment::undetermined`].
    pub(super) undetermined: Vec<Direction>,
    /// Distance that the refinement moved the end of the ascent, meters; rotations count by the scan's root mean square
    /// range.
    pub(super) refined_by_m: f64,
    /// As [`Alignment::iterations`].
    pub(super) iterations: u32,
    /// As [`Alignment::lookups`], of this ascent.
    pub(super) lookups: u64,
}

impl Fit {
    /// Measures how a scan fits at the end of an ascent, which the last stage moved by `refined_by_m`.
    pub(super) fn of(
        map: &MultiResolutionMap,
        scan: &SampledScan<'_>,
        ascent: Ascent,
        refined_by_m: f64,
        settings: &AlignmentSettings,
    ) -> Self {
        let pose = &ascent.pose;
        // A map that keeps no moments does not know its surfaces.
        let slide = if map.settings().moments { None } else { Slide::of(map, scan, pose, settings) };
        let level_overlaps = level_overlaps_until(map, scan.points, pose, scan.stop);
        let gaussians = &mut scan.surfaces.borrow_mut();
        let surfaces =
            surface_fit(map, gaussians, &scan.surface_sample, pose, &settings.refinement, scan.stop);
        let information = match slide {
            Some(slide) if slide.share > settings.slide_overlap_max => {
                surfaces.information.without(&slide.direction)
            }
            _ => surfaces.information,
        };
        Self {
            map_from_sensor: ascent.pose,
            level_overlaps,
            inliers: surfaces.inliers,
            fitness: surfaces.fitness,
            undetermined: information.undetermined(settings.undetermined_std * map.lattice().resolution_m(0)),
            information,
            refined_by_m,
            iterations: ascent.iterations,
            lookups: ascent.lookups,
        }
    }

    /// Fraction of all points in occupied voxels of level 0.
    pub(super) fn overlap(&self) -> f64 {
        self.level_overlaps.first().copied().unwrap_or(0.0)
    }

    /// True where other poses should be looked for: off the surfaces, far from where the refinement went, weakly held,
    /// or far from the guess.
    pub(super) fn is_doubtful(
        &self,
        guess: &Pose,
        map: &MultiResolutionMap,
        settings: &AlignmentSettings,
    ) -> bool {
        let (resolution_m, multi_start) = (map.lattice().resolution_m(0), &settings.multi_start);
        let (meters, degrees) = pose_difference(guess, &self.map_from_sensor);
        self.fitness < multi_start.fitness_below
            || self.refined_by_m > multi_start.correction_above * resolution_m
            || self.information.directions()[0].std_m > multi_start.std_above * resolution_m
            || meters > multi_start.motion_above * resolution_m
            || degrees > multi_start.motion_above_deg
    }

    /// The alignment that ended here, with a verdict and why.
    pub(super) fn told(self, verdict: Verdict, reason: String) -> Alignment {
        Alignment {
            map_from_sensor: self.map_from_sensor,
            verdict,
            reason,
            level_overlaps: self.level_overlaps,
            inliers: self.inliers,
            fitness: self.fitness,
            information: self.information,
            undetermined: self.undetermined,
            agreement: None,
            rivals: Vec::new(),
            contradicted_both_ways: false,
            wants_more_starts: false,
            iterations: self.iterations,
            lookups: self.lookups,
        }
    }
}
