//! The workload of a large site.

use std::f64::consts::TAU;

use nalgebra::{Translation3, UnitQuaternion};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::queries::Queries;
use super::ride::{Sight, Surface};
use mrol_map::geometry::Pose;
use mrol_map::voxel::{VoxelKey, VoxelSet};

/// A site: a square of rolling terrain, its ground two voxels of 10 cm thick. Its center is the origin; hills of 3 and
/// 2.5 m every 63 and 48 m are shifted by the seed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Number of columns along a side.
    side: i32,
    phases: [f64; 2],
}

/// Number of columns along the side of a piece: at most 131 thousand voxels.
const PIECE_SIDE: i32 = 256;
/// Number of voxels in a column.
const THICKNESS: i32 = 2;
/// Heights of the hills along x and y, meters.
const HILLS_M: [f64; 2] = [3.0, 2.5];
/// Angular frequencies of the hills along x and y, radians a meter.
const WAVES: [f64; 2] = [0.1, 0.13];
/// Largest distance of random points above or below the ground, meters.
const NEAR_M: f64 = 0.5;
/// Height of the sensor above the ground, meters.
const SENSOR_HEIGHT_M: f64 = 2.0;
/// Height of the sensor on small sites, as a share of the side: from higher up it would look beyond the border.
const SENSOR_HEIGHT_SHARE: f64 = 1.0 / 16.0;
/// Distance that the sensor moves in a revolution, meters.
const TURN_M: f64 = 1.0;
/// Largest range of the sensor, meters.
const RANGE_MAX_M: f64 = 100.0;
/// Distance from the ground at which a ray counts as hitting it, meters.
const TOUCH_M: f64 = 1e-3;

impl Site {
    /// Side of the site's voxels, meters.
    pub const RESOLUTION_M: f64 = 0.1;
    /// Default number of voxels.
    pub const VOXELS: usize = 10_000_000;
    /// Least and largest number of voxels.
    pub const VOXELS_RANGE: std::ops::RangeInclusive<u64> = 1000..=100_000_000;

    /// Makes a site of about `voxels` voxels.
    pub fn of(voxels: usize, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let side = (voxels as f64 / f64::from(THICKNESS)).sqrt().round().max(1.0) as i32;
        Self { side, phases: [0; 2].map(|_| random.random_range(0.0..TAU)) }
    }

    fn side_m(&self) -> f64 {
        f64::from(self.side) * Self::RESOLUTION_M
    }

    /// Height of the ground, meters.
    fn height_m(&self, x: f64, y: f64) -> f64 {
        let [px, py] = self.phases;
        HILLS_M[0] * (WAVES[0] * x + px).sin() + HILLS_M[1] * (WAVES[1] * y + py).sin()
    }

    /// The terrain's steepest slope, meters up a meter.
    fn slope_max() -> f64 {
        (HILLS_M[0] * WAVES[0]).hypot(HILLS_M[1] * WAVES[1])
    }

    pub(super) fn pieces(self) -> impl Iterator<Item = VoxelSet> {
        self.starts().map(move |start| self.piece(start).filter_map(VoxelKey::new).collect())
    }

    /// Indices of the site's voxels, piece by piece, row by row.
    pub(super) fn indices(self) -> impl Iterator<Item = [i32; 3]> {
        self.starts().flat_map(move |start| self.piece(start))
    }

    /// The first column of each piece.
    fn starts(self) -> impl Iterator<Item = [i32; 2]> {
        let starts = move || (0..self.side).step_by(PIECE_SIDE as usize);
        starts().flat_map(move |y| starts().map(move |x| [x, y]))
    }

    /// The voxels of the columns from `start` on.
    fn piece(self, start: [i32; 2]) -> impl Iterator<Item = [i32; 3]> {
        let [xs, ys] = start.map(|start| start..self.side.min(start + PIECE_SIDE));
        let columns = ys.flat_map(move |y| xs.clone().map(move |x| [x - self.side / 2, y - self.side / 2]));
        columns.flat_map(move |[x, y]| self.column(x, y))
    }

    /// Indices of a column's voxels: the ground passes through the middle of the column, as closely as whole voxels
    /// allow.
    fn column(self, x: i32, y: i32) -> impl Iterator<Item = [i32; 3]> + use<> {
        let [middle_x, middle_y] = [x, y].map(|i| (f64::from(i) + 0.5) * Self::RESOLUTION_M);
        let lowest = self.height_m(middle_x, middle_y) / Self::RESOLUTION_M - f64::from(THICKNESS) / 2.0;
        let lowest = lowest.round() as i32;
        (lowest..lowest + THICKNESS).map(move |z| [x, y, z])
    }

    pub(super) fn random_queries(self, count: usize, random: &mut ChaCha8Rng) -> Queries {
        let half_m = self.side_m() / 2.0;
        let near_ground = |_| {
            let [x, y] = [0; 2].map(|_| random.random_range(-half_m..half_m));
            [x, y, self.height_m(x, y) + random.random_range(-NEAR_M..NEAR_M)]
        };
        Queries::of_map_points((0..count).map(near_ground))
    }
}

impl Surface for Site {
    const SIGHT: Sight = Sight { elevation_deg: (-25.0, 2.0), noise_m: 0.04 };

    /// The path of the sensor is a circle half-way between the center and the border.
    fn sensor(&self, turn: usize) -> Pose {
        let radius_m = self.side_m() / 4.0;
        let angle = turn as f64 * TURN_M / radius_m;
        let (x, y) = (radius_m * angle.cos(), radius_m * angle.sin());
        let height_m = SENSOR_HEIGHT_M.min(self.side_m() * SENSOR_HEIGHT_SHARE);
        let place = Translation3::new(x, y, self.height_m(x, y) + height_m);
        Pose::from_parts(place, UnitQuaternion::from_euler_angles(0.01, -0.015, angle))
    }

    /// Follows the ray in steps that cannot pass through the ground: each is at most the clearance divided by how fast
    /// that can shrink.
    fn range_m(&self, from: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let shrinks = Self::slope_max() * direction[0].hypot(direction[1]) - direction[2];
        let half_m = self.side_m() / 2.0;
        let mut range_m = 0.0;
        while shrinks > 0.0 && range_m < RANGE_MAX_M {
            let [x, y, z]: [f64; 3] = std::array::from_fn(|k| from[k] + range_m * direction[k]);
            if x.abs() > half_m || y.abs() > half_m {
                return None;
            }
            let clearance_m = z - self.height_m(x, y);
            if clearance_m < TOUCH_M {
                return Some(range_m);
            }
            range_m += clearance_m / shrinks;
        }
        None
    }
}
