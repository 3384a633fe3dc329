//! What came of alignments.

use std::collections::BTreeMap;
use std::time::Duration;

use mrol_map::align::{Alignment, Verdict};
use mrol_map::geometry::{Pose, pose_difference};

/// A pose is right that is so many r_0 and degrees from the truth, at most.
const RIGHT_VOXELS: f64 = 2.0;
const RIGHT_DEG: f64 = 2.0;

/// True of a pose that is right, in a map of such voxels.
pub(super) fn is_right(found: &Pose, truth: &Pose, resolution_m: f64) -> bool {
    let (meters, degrees) = pose_difference(found, truth);
    meters <= RIGHT_VOXELS * resolution_m && degrees <= RIGHT_DEG
}

/// What came of alignments: those that found the true pose, and those that ended elsewhere.
#[derive(Debug, Clone, Default)]
pub struct Outcomes {
    /// Accepted at the true pose.
    pub right: usize,
    /// Refused at the true pose, by [verdict](Verdict::as_str).
    pub refused: BTreeMap<&'static str, usize>,
    /// Why the true pose was refused, each time.
    pub refusals: Vec<String>,
    /// Accepted at a wrong pose: how far off each is, meters and degrees (none of a scan of another place), and the
    /// reason that was given.
    pub wrong: Vec<(Option<(f64, f64)>, String)>,
    /// Refused at a wrong pose.
    pub lost: usize,
    /// How long each took, milliseconds.
    pub took_ms: Vec<f64>,
}

impl Outcomes {
    pub(super) fn add(
        &mut self,
        (alignment, took): &(Alignment, Duration),
        truth: Option<&Pose>,
        resolution_m: f64,
    ) {
        let Alignment { map_from_sensor, verdict, reason, .. } = alignment;
        self.add_pose(*took, (map_from_sensor, *verdict, reason), truth, resolution_m);
    }

    /// Adds a pose that was found, with the verdict on it and the reason.
    pub(super) fn add_pose(
        &mut self,
        took: Duration,
        (found, verdict, reason): (&Pose, Verdict, &str),
        truth: Option<&Pose>,
        resolution_m: f64,
    ) {
        self.took_ms.push(took.as_secs_f64() * 1e3);
        let is_right = truth.is_some_and(|truth| is_right(found, truth, resolution_m));
        match (verdict, is_right) {
            (Verdict::Accepted, true) => self.right += 1,
            (Verdict::Accepted, false) => {
                self.wrong.push((truth.map(|truth| pose_difference(found, truth)), reason.to_owned()));
            }
            (verdict, true) => {
                *self.refused.entry(verdict.as_str()).or_default() += 1;
                self.refusals.push(reason.to_owned());
            }
            (_, false) => self.lost += 1,
        }
    }

    /// Adds a search that found no place.
    pub(super) fn add_nothing(&mut self, took: Duration) {
        self.took_ms.push(took.as_secs_f64() * 1e3);
        self.lost += 1;
    }

    /// Adds those of other alignments.
    pub fn append(&mut self, mut other: Self) {
        self.right += other.right;
        self.lost += other.lost;
        for (verdict, count) in other.refused {
            *self.refused.entry(verdict).or_default() += count;
        }
        self.refusals.append(&mut other.refusals);
        self.wrong.append(&mut other.wrong);
        self.took_ms.append(&mut other.took_ms);
    }

    /// How long half of the alignments took at most, milliseconds.
    pub fn median_ms(&self) -> f64 {
        let mut took_ms = self.took_ms.clone();
        took_ms.sort_by(f64::total_cmp);
        took_ms.get(took_ms.len() / 2).copied().unwrap_or(0.0)
    }

    /// How long the longest took, milliseconds.
    pub fn longest_ms(&self) -> f64 {
        self.took_ms.iter().copied().fold(0.0, f64::max)
    }

    /// Number of alignments.
    pub fn alignments(&self) -> usize {
        self.right + self.refused.values().sum::<usize>() + self.wrong.len() + self.lost
    }
}
