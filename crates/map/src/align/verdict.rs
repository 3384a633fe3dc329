//! Verdicts: whether to believe an alignment, and why not.

use super::agreement::{RayAgreement, Rival};
use super::information::{Direction, PoseInformation};
use super::prior::PosePrior;
use super::settings::AlignmentSettings;
use crate::geometry::{Point, Pose};
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
    /// The scan may have been taken at other poses as well ([`Alignment::rivals`]), or the pose lies farther from the
    /// guess than other poses were looked for.
    Ambiguous,
    /// The scan fits, but earlier scans saw through its points and it saw through what they met, or the pose is not
    /// where gravity or the covariance of the guess allow.
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
    /// How rays agree there; none where the caller knows the pose.
    pub agreement: Option<RayAgreement>,
    /// Poses that the scan may have been taken at as well: why it is [ambiguous](Verdict::Ambiguous).
    pub rivals: Vec<Rival>,
    /// Rays contradict the pose both ways, more than earlier scans contradict each other, and no other pose is better:
    /// things were moved since, and the scan carves nothing.
    pub contradicted_both_ways: bool,
    /// Other poses should have been looked for, and were not:
    /// [`MultiStartSettings::ascents`](super::MultiStartSettings) is 0.
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

    /// True of a pose that the caller tells, or that rays do not contradict both ways: what a scan saw through from
    /// there is believed.
    pub fn is_beyond_doubt(&self) -> bool {
        !self.contradicted_both_ways
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

    /// An alignment at a pose that was not searched for: of the first scan of a map.
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
            agreement: None,
            rivals: Vec::new(),
            contradicted_both_ways: false,
            wants_more_starts: false,
            iterations: 0,
            lookups: 0,
        }
    }
}
