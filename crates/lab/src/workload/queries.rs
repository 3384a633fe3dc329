//! Queries: points to look up, and the order in which they come.

use nalgebra::{Translation3, UnitQuaternion};

use mrol_map::geometry::{Point, Pose};
use mrol_map::voxel::LatticeFromPoints;

/// Order of queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Order {
    /// Random points: uniform in the volume, or on a site near its surface.
    #[default]
    Random,
    /// Points in the order in which a spinning sensor of 64 rings sees the surface while it moves.
    Scan,
    /// A point in each voxel, row by row, as a survey without gaps would give.
    Sweep,
}

/// Points to look up, with the pose of their frame, which is neither upright nor at the origin, like a sensor's.
#[derive(Debug, Clone, PartialEq)]
pub struct Queries {
    /// The points, in a frame of their own, meters.
    pub points: Vec<Point>,
    /// Pose of the points' frame in the map.
    pub map_from_points: Pose,
}

impl Queries {
    /// Converts points of the map frame to a tilted frame.
    pub(super) fn of_map_points(points: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let map_from_points = tilted();
        let points_from_map = map_from_points.inverse();
        let told = |point: [f64; 3]| Point::from(points_from_map * nalgebra::Point3::from(point));
        Self { points: points.into_iter().map(told).collect(), map_from_points }
    }

    /// The first point in each voxel, for at most `most` voxels.
    pub fn first_of_each_voxel(
        self,
        lattice_from_map: impl Fn(&Pose) -> LatticeFromPoints,
        most: usize,
    ) -> Self {
        let quantize = lattice_from_map(&self.map_from_points);
        let mut seen = hashbrown::HashSet::new();
        let is_first = |&point: &Point| quantize.key(point).is_some_and(|key| seen.insert(key.to_bits()));
        Self { points: self.points.into_iter().filter(is_first).take(most).collect(), ..self }
    }
}

/// A frame that needs the whole transform: rotated about every axis and shifted.
fn tilted() -> Pose {
    Pose::from_parts(Translation3::new(1.7, -2.9, 0.4), UnitQuaternion::from_euler_angles(0.05, -0.08, 0.9))
}
