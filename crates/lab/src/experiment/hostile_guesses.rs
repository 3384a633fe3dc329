//! Experiment on hostile guesses: what an alignment accepts of guesses that are far off, and of scans of other places.

use nalgebra::{Translation3, UnitQuaternion};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::convergence::direction;
use crate::workload::Scan;
use mrol_map::align::{Alignment, AlignmentSettings, Verdict, align};
use mrol_map::geometry::{Point, Pose, pose_difference};
use mrol_map::map::{MapSettings, MapSettingsError, MappedScan, MultiResolutionMap, RobotName, ScanRecord};

/// How far hostile guesses are off, at most: meters and degrees.
pub const HOSTILE: (f64, f64) = (10.0, 180.0);
/// How far fair guesses are off, at most: meters and degrees.
pub const FAIR: (f64, f64) = (1.0, 30.0);

/// The scans of a place: a map of the even ones at their true poses, the odd ones to align.
#[derive(Debug)]
pub struct Place {
    /// Which place it is; sets of the same place have the same name.
    pub name: String,
    map: MultiResolutionMap,
    poses: Vec<Pose>,
    odd: Vec<(Vec<Point>, Pose)>,
}

/// An alignment of a scan, and what is known of it.
#[derive(Debug, Clone)]
pub struct Trial {
    /// How far off the guess was: meters and degrees. Of a scan of another place, 0.
    pub off: (f64, f64),
    /// What the alignment said.
    pub alignment: Alignment,
    /// How far off its pose is: meters and degrees; none of a scan of another place.
    pub error: Option<(f64, f64)>,
}

impl Trial {
    /// True where the pose is believed.
    pub fn is_accepted(&self) -> bool {
        self.alignment.verdict == Verdict::Accepted
    }

    /// True where the pose is so near to the truth, and was found good but for what free space says.
    pub fn is_right(&self, meters: f64, degrees: f64) -> bool {
        let is_found = matches!(self.alignment.verdict, Verdict::Accepted | Verdict::Contradicted);
        is_found && self.error.is_some_and(|error| error.0 <= meters && error.1 <= degrees)
    }

    /// True where the pose is believed, and lies farther than so much from the truth.
    pub fn is_wrong(&self, meters: f64, degrees: f64) -> bool {
        self.is_accepted() && self.error.is_none_or(|error| error.0 > meters || error.1 > degrees)
    }
}

impl Place {
    /// The place that `scans` with poses show.
    ///
    /// # Errors
    /// For settings out of range.
    pub fn of(name: &str, scans: Vec<Scan>, settings: MapSettings) -> Result<Self, MapSettingsError> {
        let map = MultiResolutionMap::new(settings)?;
        let (mut poses, mut odd) = (Vec::new(), Vec::new());
        for (k, scan) in scans.into_iter().enumerate() {
            let (Some(pose), Some(robot)) = (scan.map_from_sensor, RobotName::new("surveyor").ok()) else {
                continue;
            };
            if k % 2 == 1 {
                odd.push((scan.points, pose));
                continue;
            }
            poses.push(pose);
            let taken = MappedScan::new(robot, pose);
            map.committer().insert_scan(ScanRecord::of_points(taken, &scan.points, map.lattice()));
        }
        Ok(Self { name: name.to_owned(), map, poses, odd })
    }

    /// True where there is no scan to align.
    pub fn is_empty(&self) -> bool {
        self.odd.is_empty() || self.poses.is_empty()
    }

    /// Aligns the odd scans in turn, `count` in all, from guesses off by up to `most` (meters, degrees).
    pub fn align_from_off(
        &self,
        count: usize,
        most: (f64, f64),
        settings: &AlignmentSettings,
        random: &mut ChaCha8Rng,
        mut done: impl FnMut(),
    ) -> Vec<Trial> {
        let trial = |(points, truth): &(Vec<Point>, Pose)| {
            let off = (random.random_range(0.0..most.0), random.random_range(0.0..most.1));
            let guess = off_by(truth, off, random);
            let alignment = align(&self.map, points, &guess, settings);
            let error = Some(pose_difference(&alignment.map_from_sensor, truth));
            done();
            Trial { off, alignment, error }
        };
        self.odd.iter().cycle().take(count).map(trial).collect()
    }

    /// Aligns the odd scans of `other`, another place, to this map, `count` in all, from guesses near this map's
    /// viewpoints.
    pub fn align_others(
        &self,
        other: &Self,
        count: usize,
        settings: &AlignmentSettings,
        random: &mut ChaCha8Rng,
        mut done: impl FnMut(),
    ) -> Vec<Trial> {
        let trial = |(points, _): &(Vec<Point>, Pose)| {
            let viewpoint = &self.poses[random.random_range(0..self.poses.len())];
            let guess = off_by(viewpoint, FAIR, random);
            let alignment = align(&self.map, points, &guess, settings);
            done();
            Trial { off: (0.0, 0.0), alignment, error: None }
        };
        other.odd.iter().cycle().take(count).map(trial).collect()
    }
}

/// A pose so many meters and degrees off `truth`, in a uniform direction and about a uniform axis.
pub(super) fn off_by(truth: &Pose, (meters, degrees): (f64, f64), random: &mut ChaCha8Rng) -> Pose {
    let shift = Translation3::from(direction(random) * meters);
    let turn = UnitQuaternion::from_scaled_axis(direction(random) * degrees.to_radians());
    Pose::from_parts(shift * truth.translation, turn * truth.rotation)
}

/// The random numbers of a seed.
pub fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}
