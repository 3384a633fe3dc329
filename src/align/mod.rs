//! Scan to map alignment (paper III-A, III-B).
//!
//! [`align`] reads like the paper's summary: a volumetric sample, an ascent on overlap at each level from
//! coarse to fine, and a sub-voxel ascent with all points.

mod ascent;
mod overlap;
mod settings;

pub use overlap::{level_overlaps, overlap};
pub use settings::{AlignmentSettings, AlignmentSettingsError};

use crate::geometry::{Point, Pose};
use crate::map::MultiResolutionMap;
use crate::voxel::volumetric_sample;
use ascent::{Ascent, Steps};
use overlap::Overlap;

/// Where a scan is thought to have been taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Guess {
    /// At the robot's last accepted pose: the paper's guess.
    #[default]
    Last,
    /// There: map_from_sensor.
    Pose(Pose),
    /// This far from the robot's last accepted pose: last_from_sensor, as odometry tells.
    Motion(Pose),
}

/// What an alignment is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The scan fits the map.
    Accepted,
    /// Too few of its points fall in occupied voxels.
    LowOverlap,
}

impl Verdict {
    /// `accepted` or `low_overlap`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::LowOverlap => "low_overlap",
        }
    }
}

/// Where a scan was taken, and how it fits the map there.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// The pose found.
    pub map_from_sensor: Pose,
    /// Whether to believe it.
    pub verdict: Verdict,
    /// Fraction of all points in occupied voxels by the exact set, level by level, finest first.
    pub level_overlaps: Vec<f64>,
    /// Steps that moved the pose, over all levels.
    pub iterations: u32,
    /// Look-ups made, one a point and candidate pose; their expected number of false positives is what "the
    /// filter is ample" is about (paper IV-B).
    pub lookups: u64,
}

impl Alignment {
    /// Fraction of all points in occupied voxels of level 0.
    pub fn overlap(&self) -> f64 {
        self.level_overlaps.first().copied().unwrap_or(0.0)
    }
}

/// Finds the pose of a scan by sequential multi-resolution alignment (paper III-B), from a guess.
///
/// `points` are in the sensor frame and finite. The map may change meanwhile: each step of the ascent sees one
/// revision of it.
pub fn align(
    map: &MultiResolutionMap,
    points: &[Point],
    guess: &Pose,
    settings: &AlignmentSettings,
) -> Alignment {
    // 1) Take a volumetric sample of points.
    let sample = volumetric_sample(points, settings.sample_points, settings.seed);
    let mut ascent = Ascent::from(*guess);

    // 2) - 4) Align iteratively at each level, coarse to fine, each from where the coarser one ended.
    for level in (0..map.settings().levels).rev() {
        let overlap = Overlap::new(map, &sample.points, level, settings.lookup);
        ascent.climb(&overlap, Steps::of_level(level, map, settings), settings.iterations_per_level_max);
    }

    // 5) Sub-voxel alignment with all points and small steps.
    let overlap = Overlap::new(map, points, 0, settings.lookup);
    for halvings in 0..=settings.sub_voxel_halvings {
        let steps = Steps::sub_voxel(map, settings).halved(halvings);
        ascent.climb(&overlap, steps, settings.sub_voxel_iterations_max);
    }
    judge(map, points, ascent, settings)
}

/// Says how a scan fits the map where it is thought to be, without moving it.
pub fn judge_at(
    map: &MultiResolutionMap,
    points: &[Point],
    map_from_sensor: &Pose,
    settings: &AlignmentSettings,
) -> Alignment {
    judge(map, points, Ascent::from(*map_from_sensor), settings)
}

fn judge(
    map: &MultiResolutionMap,
    points: &[Point],
    ascent: Ascent,
    settings: &AlignmentSettings,
) -> Alignment {
    let level_overlaps = level_overlaps(map, points, &ascent.pose);
    let fits = level_overlaps[0] >= settings.overlap_min;
    Alignment {
        map_from_sensor: ascent.pose,
        verdict: if fits { Verdict::Accepted } else { Verdict::LowOverlap },
        level_overlaps,
        iterations: ascent.iterations,
        lookups: ascent.lookups,
    }
}
