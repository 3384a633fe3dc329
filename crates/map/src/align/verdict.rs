//! Verdicts: whether to believe an alignment, and why not.

use super::agreement::{RayAgreement, Rival};
use super::information::{Direction, PoseInformation};
use super::prior::PosePrior;
use super::refine::SurfaceFit;
use super::settings::AlignmentSettings;
use super::slide::Slide;
use crate::geometry::{Point, Pose, pose_difference};
use crate::map::MultiResolutionMap;

/// Whether to believe the pose that an alignment found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The scan fits the map.
    Accepted,
    /// The scan and earlier scans saw too little of each other.
    LowOverlap,
    /// The scan fits, but would fit elsewhere too: what it sees of the map (one blank wall, a straight corridor) leaves
    /// a direction open, or rays agree as well a little aside.
    Undetermined,
    /// The scan may have been taken at other poses as well ([`Alignment::rivals`]), or the pose lies farther from the guess than
    /// other poses were looked for.
    Ambiguous,
    /// The scan fits, but earlier scans saw through its points and it saw through what they met, or the pose is not where
    /// gravity or the covariance of the guess allow.
    Contradicted,
}

impl Verdict {
    /// All verdicts.
    pub const ALL: [Self; 5] =
        [Self::Accepted, Self::LowOverlap, Self::Undetermined, Self::Ambiguous, Self::Contradicted];

    /// The verdict's name: `accepted`, `low_overlap`, `undetermined`, `ambiguous` or `contradicted`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::LowOverlap => "low_overlap",
            Self::Undetermined => "undetermined",
            Self::Ambiguous => "ambiguous",
            Self::Contradicted => "contradicted",
        }
    }
}

/// Result of an alignment: where a scan was taken, and how it fits the map there.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// The pose that was found, map_from_sensor.
    pub map_from_sensor: Pose,
    /// Whether to believe it.
    pub verdict: Verdict,
    /// Reason for the verdict, a sentence with the figures.
    pub reason: String,
    /// Fraction of all points in occupied voxels by the exact set, level by level, finest first.
    pub level_overlaps: Vec<f64>,
    /// Fraction of a volumetric sample of the points that lie on the map's surfaces.
    pub inliers: f64,
    /// Mean robust weight of the sample's points, 0 to 1; a point off every surface counts 0.
    pub fitness: f64,
    /// Information that the map's surfaces give about the pose.
    pub information: PoseInformation,
    /// Directions of the pose that the map's surfaces leave open, the least certain first.
    pub undetermined: Vec<Direction>,
    /// Distance that the refinement moved the end of the ascent, meters; rotations count by the scan's root mean square
    /// range.
    pub refined_by_m: f64,
    /// How rays agree there; none where the caller knows the pose.
    pub agreement: Option<RayAgreement>,
    /// Poses that the scan may have been taken at as well: why it is [ambiguous](Verdict::Ambiguous).
    pub rivals: Vec<Rival>,
    /// Rays contradict the pose both ways, more than earlier scans contradict each other, and no other pose is better: things were
    /// moved since, and the scan carves nothing.
    pub contradicted_both_ways: bool,
    /// Other poses should have been looked for, and were not: [`MultiStartSettings::ascents`](super::MultiStartSettings) is 0.
    pub wants_more_starts: bool,
    /// Number of steps that moved the pose, over all stages.
    pub iterations: u32,
    /// Number of look-ups, one for each point and candidate pose. Times the false positive rate it is the expected
    /// number of wrong answers, which is below one where the filter is ample (paper IV-B).
    pub lookups: u64,
}

impl Alignment {
    /// Fraction of all points in occupied voxels of level 0.
    pub fn overlap(&self) -> f64 {
        self.level_overlaps.first().copied().unwrap_or(0.0)
    }

    /// True of a pose that the caller tells, or that rays do not contradict both ways: what a scan saw through from there is
    /// believed.
    pub fn is_beyond_doubt(&self) -> bool {
        !self.contradicted_both_ways
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
            || self.refined_by_m > settings.refinement_max_correction * resolution_m
            || self.information.directions()[0].std_m > multi_start.std_above * resolution_m
            || meters > multi_start.motion_above * resolution_m
            || degrees > multi_start.motion_above_deg
    }

    /// Changes the verdict from accepted where the pose contradicts what was known of it beforehand.
    pub(super) fn within_prior(
        self,
        prior: &PosePrior,
        map: &MultiResolutionMap,
        settings: &AlignmentSettings,
    ) -> Self {
        if self.verdict != Verdict::Accepted {
            return self;
        }
        match prior.against(&self.map_from_sensor, map.lattice().resolution_m(0), settings) {
            Some(reason) => self.but(Verdict::Contradicted, reason),
            None => self,
        }
    }

    /// This alignment with another verdict, and why.
    pub fn but(self, verdict: Verdict, reason: String) -> Self {
        Self { verdict, reason, ..self }
    }
}

/// How a scan fits at a pose, before it is judged.
#[derive(Debug)]
pub(super) struct Fit {
    pub(super) map_from_sensor: Pose,
    /// Distance that the refinement moved the pose, meters; rotations count by the points' range.
    pub(super) refined_by_m: f64,
    /// What a shift leaves of the overlap, where the map does not know its surfaces.
    pub(super) slide: Option<Slide>,
    pub(super) level_overlaps: Vec<f64>,
    pub(super) surfaces: SurfaceFit,
    pub(super) iterations: u32,
    pub(super) lookups: u64,
}

impl Fit {
    /// Turns the fit into an alignment with a verdict: accepted with enough overlap, determined in every direction, and
    /// where the ascent had led.
    pub(super) fn judged(self, map: &MultiResolutionMap, settings: &AlignmentSettings) -> Alignment {
        let resolution_m = map.lattice().resolution_m(0);
        let (overlap, overlap_min) = (self.level_overlaps[0], settings.overlap_min);
        let open_m = settings.undetermined_std * resolution_m;
        let max_correction_m = settings.refinement_max_correction * resolution_m;
        let information = match &self.slide {
            Some(slide) if slide.share > settings.slide_overlap_max => {
                self.surfaces.information.without(&slide.direction)
            }
            _ => self.surfaces.information,
        };
        let undetermined = information.undetermined(open_m);
        let (verdict, reason) = if overlap < overlap_min {
            (Verdict::LowOverlap, format!("overlap {overlap:.3} is below overlap_min {overlap_min}"))
        } else if let Some(worst) = undetermined.first() {
            (Verdict::Undetermined, format!("open along {worst}, at most {open_m:.3} m is accepted"))
        } else if self.refined_by_m > max_correction_m {
            let moved_m = self.refined_by_m;
            let reason = format!(
                "the refinement moved it by {moved_m:.3} m, at most {max_correction_m:.3} m is accepted"
            );
            (Verdict::Undetermined, reason)
        } else {
            let reason = match &self.slide {
                None => format!(
                    "overlap {overlap:.3}, held to {:.4} m in every direction",
                    information.directions()[0].std_m
                ),
                Some(slide) => format!(
                    "overlap {overlap:.3}, of which {:.3} is left {:.2} m aside; the map keeps no moments",
                    slide.share,
                    settings.slide * resolution_m
                ),
            };
            (Verdict::Accepted, reason)
        };
        Alignment {
            map_from_sensor: self.map_from_sensor,
            verdict,
            reason,
            level_overlaps: self.level_overlaps,
            inliers: self.surfaces.inliers,
            fitness: self.surfaces.fitness,
            information,
            undetermined,
            refined_by_m: self.refined_by_m,
            agreement: None,
            rivals: Vec::new(),
            contradicted_both_ways: false,
            wants_more_starts: false,
            iterations: self.iterations,
            lookups: self.lookups,
        }
    }
}

impl Alignment {
    /// An alignment at a pose that was not searched for: the caller's word, or the first scan of a map.
    pub fn trusted(map_from_sensor: Pose, levels: u32, points: &[Point]) -> Self {
        Self {
            map_from_sensor,
            verdict: Verdict::Accepted,
            reason: "the first scan of the map".into(),
            level_overlaps: vec![0.0; levels as usize],
            inliers: 0.0,
            fitness: 0.0,
            information: PoseInformation::none(points),
            undetermined: Vec::new(),
            refined_by_m: 0.0,
            agreement: None,
            rivals: Vec::new(),
            contradicted_both_ways: false,
            wants_more_starts: false,
            iterations: 0,
            lookups: 0,
        }
    }

    /// This alignment, accepted because the caller says so.
    pub fn accepted_by_caller(self) -> Self {
        self.but(Verdict::Accepted, "the caller's word".into())
    }
}
