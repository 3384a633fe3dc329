//! From the frames of links to cells of a level: the one definition of where the center of a sphere lies.
//!
//! In f64 and in this order, so that every path agrees bit for bit: rotation and translation are scaled to cells, and a
//! center is `((r0 * x + r1 * y) + r2 * z) + t`. The quaternion need not be of unit length.

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};

use super::configurations::NUMBERS_PER_POSE;
use crate::geometry::Pose;
use crate::planning::clearance::LANES;
use crate::voxel::{Lattice, LatticeFromPoints};

/// Where a link is, in the map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::planning) struct LinkPose {
    pub(in crate::planning) translation_m: [f64; 3],
    /// A quaternion of any length but zero.
    pub(super) rotation_xyzw: [f64; 4],
}

impl LinkPose {
    /// The pose that x y z qx qy qz qw are.
    #[inline(always)]
    pub(in crate::planning) fn of(pose: &[f32; NUMBERS_PER_POSE]) -> Self {
        let [px, py, pz, x, y, z, w] = pose.map(f64::from);
        Self { translation_m: [px, py, pz], rotation_xyzw: [x, y, z, w] }
    }

    /// The transform from points of the link to finest voxels, as look-ups take it.
    pub(in crate::planning) fn lattice_from_points(&self, lattice: &Lattice) -> LatticeFromPoints {
        let [x, y, z, w] = self.rotation_xyzw;
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        lattice
            .from_points(&Pose::from_parts(Translation3::from(Vector3::from(self.translation_m)), rotation))
    }
}

/// The transform from points of a link, meters, to cells of a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::planning) struct CellsFromLink {
    pub(super) rotation: [[f64; 3]; 3],
    pub(super) translation: [f64; 3],
}

impl CellsFromLink {
    /// The transform of a pose.
    #[inline(always)]
    pub(in crate::planning) fn of(pose: &LinkPose, cells_per_m: f64) -> Self {
        let LinkPose { translation_m, rotation_xyzw: [x, y, z, w] } = *pose;
        let s = 2.0 / (((x * x + y * y) + z * z) + w * w);
        let (xs, ys, zs) = (x * s, y * s, z * s);
        let (xx, yy, zz) = (x * xs, y * ys, z * zs);
        let (xy, xz, yz) = (x * ys, x * zs, y * zs);
        let (wx, wy, wz) = (w * xs, w * ys, w * zs);
        let rotation = [
            [1.0 - (yy + zz), xy - wz, xz + wy],
            [xy + wz, 1.0 - (xx + zz), yz - wx],
            [xz - wy, yz + wx, 1.0 - (xx + yy)],
        ];
        Self {
            rotation: rotation.map(|row| row.map(|r| r * cells_per_m)),
            translation: translation_m.map(|t| t * cells_per_m),
        }
    }

    /// Where a point of the link lies, in cells.
    #[inline(always)]
    pub(in crate::planning) fn cells(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            let [r0, r1, r2] = self.rotation[axis];
            ((r0 * x + r1 * y) + r2 * z) + self.translation[axis]
        })
    }
}

/// The transforms of up to eight links, number by number, lane by lane.
#[derive(Debug, Clone)]
pub(in crate::planning) struct EightTransforms {
    rotation: [[[f64; LANES]; 3]; 3],
    translation: [[f64; LANES]; 3],
}

impl EightTransforms {
    /// No pose yet.
    pub(in crate::planning) const NOTHING: Self =
        Self { rotation: [[[0.0; LANES]; 3]; 3], translation: [[0.0; LANES]; 3] };

    /// Sets the transforms of up to eight poses; lanes beyond them repeat the first.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "a lane goes through several arrays")]
    pub(in crate::planning) fn set(&mut self, poses: &[[f32; NUMBERS_PER_POSE]], cells_per_m: f64) {
        let mut numbers = [[0f32; LANES]; NUMBERS_PER_POSE];
        for lane in 0..LANES {
            let pose = &poses[if lane < poses.len() { lane } else { 0 }];
            for (numbers, number) in numbers.iter_mut().zip(pose) {
                numbers[lane] = *number;
            }
        }
        for lane in 0..LANES {
            let number = |n: usize| f64::from(numbers[n][lane]);
            let pose = LinkPose {
                translation_m: [number(0), number(1), number(2)],
                rotation_xyzw: [number(3), number(4), number(5), number(6)],
            };
            let transform = CellsFromLink::of(&pose, cells_per_m);
            for axis in 0..3 {
                self.translation[axis][lane] = transform.translation[axis];
                for column in 0..3 {
                    self.rotation[axis][column][lane] = transform.rotation[axis][column];
                }
            }
        }
    }

    /// Leaves some of the lanes, one at least; the others repeat the first of them.
    #[inline(always)]
    pub(in crate::planning) fn leave(&mut self, lanes: u8) {
        let first = lanes.trailing_zeros() as usize % LANES;
        let numbers = self.rotation.as_flattened_mut().iter_mut().chain(&mut self.translation);
        for number in numbers {
            let repeated = number[first];
            for (lane, number) in number.iter_mut().enumerate() {
                *number = if lanes >> lane & 1 == 1 { *number } else { repeated };
            }
        }
    }

    /// The transform in one lane.
    #[inline(always)]
    pub(in crate::planning) fn lane(&self, lane: usize) -> CellsFromLink {
        CellsFromLink {
            // By index: to map the arrays would copy them.
            rotation: std::array::from_fn(|axis| {
                std::array::from_fn(|column| self.rotation[axis][column][lane])
            }),
            translation: std::array::from_fn(|axis| self.translation[axis][lane]),
        }
    }

    /// Where a point of each link lies, in cells, each by its own transform.
    #[inline(always)]
    pub(super) fn cells(&self, points_m: &[[f64; LANES]; 3]) -> [[f64; LANES]; 3] {
        let mut cells = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let cell = self.lane(lane).cells([0, 1, 2].map(|axis: usize| points_m[axis][lane]));
            (0..3).for_each(|axis| cells[axis][lane] = cell[axis]);
        }
        cells
    }
}
