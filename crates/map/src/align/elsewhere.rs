//! Elsewhere: poses at which a scan may fit as well as at one where it was found, looked for with a few points.
//!
//! In a rectangular room a robot that turned unseen fits the walls twice or four times, along an aisle at every
//! upright. Few points on coarse voxels tell cheaply where; whether a scan was taken there is for rays to say.

use std::cmp::Reverse;
use std::f64::consts::TAU;

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::agreement::spread;
use super::ascent::{Ascent, Steps};
use super::overlap::Overlap;
use super::sampled_scan::SampledScan;
use super::settings::AlignmentSettings;
use crate::geometry::{Point, Pose, pose_difference};
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;

/// Yaws at which a robot may stand that was turned: the basin of a coarse level's ascent is some 30 degrees wide.
const YAWS: u32 = 12;
/// Points with which it is found out which of them are worth an ascent with all.
const FEW: usize = 250;
/// The finest level that turned poses are looked for on: its ascents tell a place from another, and take few steps.
pub(super) const LEVEL_OF_TURNS: u32 = 2;
/// The level that shifted poses are looked for on, in steps of its voxels: things repeat every few voxels.
pub(super) const LEVEL_OF_SHIFTS: u32 = 1;
/// Share of the overlap of the pose that was found which another one has to have to be worth an ascent with all points.
const AS_GOOD: f64 = 0.8;
/// The same before its ascent with few points, where it lies up to half a step aside.
const AS_GOOD_ASIDE: f64 = 0.6;
/// Floors lie at least so far above each other, meters.
const STOREY_MIN_M: f64 = 2.0;
/// Shifted poses that are ascended from with few points, at most, and poses that are found to be as good.
const SHIFTED: usize = 16;
const FOUND: usize = 8;
/// Steps along one axis to one side, at most.
const STEPS_MAX: f64 = 64.0;

/// A few points of a scan, on one level of a map and those above it.
struct Few<'a> {
    map: &'a MultiResolutionMap,
    points: Vec<Point>,
    level: u32,
    settings: &'a AlignmentSettings,
    stop: StopSignal<'a>,
}

/// Where a scan that was found at `pose` may fit as well, turned about the map's z axis: there, and at `guess`, where
/// that lies elsewhere. A robot that turned in a room is found on its other side, where its walls look the same.
pub(super) fn turned(
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    pose: &Pose,
    guess: &Pose,
    settings: &AlignmentSettings,
) -> Vec<Pose> {
    let few = Few::of(map, scan, LEVEL_OF_TURNS, settings);
    let about = |translation: Translation3<f64>| {
        (0..YAWS).map(move |yaw| {
            let yaw = TAU * f64::from(yaw) / f64::from(YAWS);
            let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * yaw);
            Pose::from_parts(translation, turn * pose.rotation)
        })
    };
    let at_guess = few.is_elsewhere(pose, &Pose::from_parts(guess.translation, pose.rotation));
    let at_guess = at_guess.then(|| about(guess.translation)).into_iter().flatten();
    let least = AS_GOOD * few.overlap(few.level).at(&[*pose], few.stop)[0] as f64;
    let guesses = about(pose.translation).skip(1).chain(at_guess).collect();
    few.as_good(pose, guesses, map.settings().levels - 1, least)
}

/// Where a scan that was found at `pose` may fit as well, shifted along `axes` (of length 1, map frame) by up to
/// `possible_m`, either way.
pub(super) fn shifted(
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    pose: &Pose,
    axes: &[Vector3<f64>],
    possible_m: impl Fn(Vector3<f64>) -> f64,
    settings: &AlignmentSettings,
) -> Vec<Pose> {
    let few = Few::of(map, scan, LEVEL_OF_SHIFTS, settings);
    let overlap = few.overlap(few.level).at(&[*pose], few.stop)[0] as f64;
    let axes = axes.iter().map(|&axis| (axis, possible_m(axis)));
    let mut peaks = few.peaks(pose, axes, AS_GOOD_ASIDE * overlap);
    // Where things repeat, the next place is the hardest to tell.
    peaks.sort_by(|a, b| pose_difference(a, pose).0.total_cmp(&pose_difference(b, pose).0));
    peaks.truncate(SHIFTED);
    few.as_good(pose, peaks, few.level, AS_GOOD * overlap)
}

/// Where a scan that was found at `pose`, and is contradicted there, may have been taken on another floor, up to
/// `possible_m` above or below. That may be mapped less than this one, so that it need not fit as well. But a floor
/// fits a ceiling anywhere, and above that nobody looked.
pub(super) fn on_other_floors(
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    pose: &Pose,
    possible_m: f64,
    settings: &AlignmentSettings,
) -> Vec<Pose> {
    let few = Few::of(map, scan, LEVEL_OF_SHIFTS, settings);
    let least = AS_GOOD_ASIDE * few.overlap(few.level).at(&[*pose], few.stop)[0] as f64;
    let mut peaks = few.peaks(pose, [(Vector3::z(), possible_m)], least);
    let above_m = |peak: &Pose| (peak.translation.vector - pose.translation.vector).norm();
    peaks.retain(|peak| above_m(peak) >= STOREY_MIN_M);
    few.as_good(pose, peaks, few.level, least)
}

impl<'a> Few<'a> {
    fn of(
        map: &'a MultiResolutionMap,
        scan: &'a SampledScan<'_>,
        level: u32,
        settings: &'a AlignmentSettings,
    ) -> Self {
        let level = level.min(map.settings().levels - 1);
        Self { map, points: spread(&scan.sample, FEW), level, settings, stop: scan.stop }
    }

    fn overlap(&self, level: u32) -> Overlap<'_> {
        Overlap::new(self.map, &self.points, level, self.settings.lookup)
    }

    /// Places at which `least` points and more fall in occupied voxels, and more than beside them, shifted from `pose`
    /// along axes by up to so many meters, either way.
    fn peaks(
        &self,
        pose: &Pose,
        axes: impl IntoIterator<Item = (Vector3<f64>, f64)>,
        least: f64,
    ) -> Vec<Pose> {
        let step_m = self.map.lattice().resolution_m(self.level);
        let overlap = self.overlap(self.level);
        let mut peaks: Vec<Pose> = Vec::new();
        for (axis, possible_m) in axes {
            let steps = (possible_m / step_m).floor().clamp(0.0, STEPS_MAX) as i32;
            let at = |step: i32| {
                let way = axis * (f64::from(step) * step_m);
                Pose::from_parts(Translation3::from(way) * pose.translation, pose.rotation)
            };
            let poses: Vec<Pose> = (-steps..=steps).map(at).collect();
            let heights = overlap.at(&poses, self.stop);
            let is_peak = |i: usize| {
                let beside = |j: usize| heights.get(j).copied().unwrap_or(0);
                let before = if i == 0 { 0 } else { beside(i - 1) };
                heights[i] as f64 >= least && heights[i] >= before && heights[i] >= beside(i + 1)
            };
            peaks.extend((0..poses.len()).filter(|&i| is_peak(i)).map(|i| poses[i]));
        }
        // A peak is seen up to half a step aside.
        peaks.retain(|peak| pose_difference(peak, pose).0 > 1.5 * step_m);
        peaks
    }

    /// The ends of ascents from `guesses`, from the level `coarsest` on, with `least` points and more in occupied
    /// voxels, each elsewhere than `pose` and the others.
    fn as_good(&self, pose: &Pose, guesses: Vec<Pose>, coarsest: u32, least: f64) -> Vec<Pose> {
        let climbed = guesses.into_iter().map(|guess| {
            let mut ascent = Ascent::from(guess);
            for level in (self.level..=coarsest).rev() {
                let steps = Steps::of_level(level, self.map.lattice(), self.settings);
                ascent.climb(&self.overlap(level), steps, self.settings.iterations_per_level_max, self.stop);
            }
            ascent.pose
        });
        let poses: Vec<Pose> = climbed.collect();
        let heights = self.overlap(self.level).at(&poses, self.stop);
        let mut ranked: Vec<_> = heights.iter().zip(&poses).collect();
        ranked.sort_by_key(|(height, _)| Reverse(**height));
        let mut as_good: Vec<Pose> = Vec::new();
        for (height, end) in ranked {
            let is_new = std::iter::once(pose).chain(&as_good).all(|other| self.is_elsewhere(end, other));
            if as_good.len() < FOUND && *height as f64 >= least && is_new {
                as_good.push(*end);
            }
        }
        as_good
    }

    /// True of poses too far apart for an ascent from one to end at the other.
    fn is_elsewhere(&self, a: &Pose, b: &Pose) -> bool {
        let (meters, degrees) = pose_difference(a, b);
        meters > 2.0 * self.map.lattice().resolution_m(self.level) || degrees > 10.0
    }
}
