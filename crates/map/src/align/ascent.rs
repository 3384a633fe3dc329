//! Fixed-step steepest ascent over poses (paper III-B, steps 2 and 5).

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::overlap::Overlap;
use super::settings::AlignmentSettings;
use crate::geometry::Pose;
use crate::util::StopSignal;
use crate::voxel::Lattice;

/// Step sizes of the ascent: how far one move shifts the sensor (meters) and turns it (radians).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Steps {
    translation_m: f64,
    rotation_rad: f64,
}

impl Steps {
    /// The steps of `level` n: by default dx = r_n and dtheta = 0.5 deg * 2^n.
    pub(super) fn of_level(level: u32, lattice: &Lattice, settings: &AlignmentSettings) -> Self {
        Self {
            translation_m: settings.translation_step * lattice.resolution_m(level),
            rotation_rad: settings.rotation_step_deg.to_radians() * f64::from(1u32 << level),
        }
    }

    /// The first steps of the sub-voxel stage: by default dx = r_0 / 2 and dtheta = 0.25 deg.
    pub(super) fn sub_voxel(lattice: &Lattice, settings: &AlignmentSettings) -> Self {
        Self {
            translation_m: settings.sub_voxel_translation_step * lattice.resolution_m(0),
            rotation_rad: settings.sub_voxel_rotation_step_deg.to_radians(),
        }
    }

    pub(super) fn halved(self, times: u32) -> Self {
        let scale = 0.5f64.powi(times as i32);
        Self { translation_m: self.translation_m * scale, rotation_rad: self.rotation_rad * scale }
    }
}

/// The six directions of a single-axis move: plus and minus along x, y and z.
const SINGLE_AXIS: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];

/// State of a steepest ascent: the pose that it stands at, and what it has cost so far.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ascent {
    pub(super) pose: Pose,
    pub(super) iterations: u32,
    pub(super) lookups: u64,
}

impl From<Pose> for Ascent {
    fn from(guess: Pose) -> Self {
        Self { pose: guess, iterations: 0, lookups: 0 }
    }
}

impl Ascent {
    /// Climbs: moves to the neighbor of highest overlap until none is higher than the present pose (a tie keeps the
    /// pose), `iterations_max` moves were made, or the ascent is stopped.
    pub(super) fn climb(
        &mut self,
        overlap: &Overlap<'_>,
        steps: Steps,
        iterations_max: u32,
        stop: StopSignal<'_>,
    ) {
        let mut height = overlap.at(std::slice::from_ref(&self.pose), stop)[0];
        self.lookups += overlap.lookups();
        for _ in 0..iterations_max {
            stop.give_way();
            if stop.is_stopped() {
                return;
            }
            let candidates = neighbors(&self.pose, steps);
            let heights = overlap.at(&candidates, stop);
            // Heights of a look-up that was stopped are too low, each by as much as it happens.
            if stop.is_stopped() {
                return;
            }
            self.lookups += overlap.lookups() * candidates.len() as u64;
            let Some(best) = highest(&heights).filter(|&i| heights[i] > height) else {
                return;
            };
            (self.pose, height) = (candidates[best], heights[best]);
            self.iterations += 1;
        }
    }
}

/// Index of the largest of `heights`; of equal ones the first.
fn highest(heights: &[usize]) -> Option<usize> {
    (0..heights.len()).rev().max_by_key(|&i| heights[i])
}

/// The 48 neighbors of a pose: 6 shifts, 6 turns, and the 36 pairs of a shift and a turn. Shifts are along the
/// map's axes; turns are about them, through the sensor.
fn neighbors(pose: &Pose, steps: Steps) -> Vec<Pose> {
    let shifts = SINGLE_AXIS.map(|axis| Translation3::from(Vector3::from(axis) * steps.translation_m));
    let turns =
        SINGLE_AXIS.map(|axis| UnitQuaternion::from_scaled_axis(Vector3::from(axis) * steps.rotation_rad));
    let moved = |shift: &Translation3<f64>, turn: &UnitQuaternion<f64>| {
        Pose::from_parts(
            shift * pose.translation,
            UnitQuaternion::new_normalize((turn * pose.rotation).into_inner()),
        )
    };
    let (stay, straight) = (Translation3::identity(), UnitQuaternion::identity());
    let mut poses = Vec::with_capacity(48);
    poses.extend(shifts.iter().map(|shift| moved(shift, &straight)));
    poses.extend(turns.iter().map(|turn| moved(&stay, turn)));
    poses.extend(shifts.iter().flat_map(|shift| turns.iter().map(move |turn| moved(shift, turn))));
    poses
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::pose_difference;

    #[test]
    fn a_pose_has_48_neighbors_one_step_away() {
        let pose = Pose::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.3, -0.2, 0.1));
        let steps = Steps { translation_m: 0.1, rotation_rad: 0.02 };
        let neighbors = neighbors(&pose, steps);
        assert_eq!(neighbors.len(), 48);
        for (i, neighbor) in neighbors.iter().enumerate() {
            let shift = (neighbor.translation.vector - pose.translation.vector).norm();
            let turn = (neighbor.rotation * pose.rotation.inverse()).angle();
            let expected = if i < 6 {
                (0.1, 0.0)
            } else if i < 12 {
                (0.0, 0.02)
            } else {
                (0.1, 0.02)
            };
            assert!(
                (shift - expected.0).abs() < 1e-12 && (turn - expected.1).abs() < 1e-7,
                "{i}: {shift} {turn}"
            );
            assert!(neighbors[..i].iter().all(|other| pose_difference(other, neighbor) != (0.0, 0.0)));
        }
    }

    #[test]
    fn the_first_of_the_highest_wins() {
        assert_eq!(highest(&[1, 5, 5, 2]), Some(1));
    }
}
