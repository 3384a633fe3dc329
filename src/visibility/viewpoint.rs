//! A viewpoint: where a scan was taken, and how far it saw from there.

use super::RangeImage;
use crate::geometry::Pose;

/// Where a scan was taken, and how far it saw in each direction (paper III-B).
#[derive(Debug, Clone, PartialEq)]
pub struct Viewpoint {
    map_from_sensor: Pose,
    image: RangeImage,
    /// Rows of the rotation from the map to the sensor.
    rotation: [[f32; 3]; 3],
}

impl Viewpoint {
    /// The viewpoint of a scan that was taken at `map_from_sensor`.
    pub fn new(map_from_sensor: Pose, image: RangeImage) -> Self {
        let rotation = map_from_sensor.rotation.inverse().to_rotation_matrix();
        let row = |r: usize| std::array::from_fn(|c| rotation[(r, c)] as f32);
        Self { map_from_sensor, image, rotation: std::array::from_fn(row) }
    }

    /// Where the scan was taken.
    pub fn map_from_sensor(&self) -> &Pose {
        &self.map_from_sensor
    }

    /// How far it saw, in the sensor frame.
    pub fn image(&self) -> &RangeImage {
        &self.image
    }

    /// True where the scan saw beyond `point_m` (map frame, meters).
    #[inline]
    pub fn sees_through(&self, point_m: [f64; 3]) -> bool {
        self.image.sees_through(self.offset(point_m))
    }

    /// The offset of a point of the map from the sensor, in the sensor's frame, meters: computed in one order, so that it is the
    /// same on every machine.
    #[inline(always)]
    pub fn offset(&self, point_m: [f64; 3]) -> [f32; 3] {
        let origin = &self.map_from_sensor.translation.vector;
        let [x, y, z] = std::array::from_fn(|axis| (point_m[axis] - origin[axis]) as f32);
        self.rotation.map(|[r0, r1, r2]| (r0 * x + r1 * y) + r2 * z)
    }

    /// The points up to which it saw, map frame, meters.
    pub fn seen_m(&self) -> impl Iterator<Item = [f64; 3]> {
        self.image.seen().map(|offset| {
            let point: [f64; 3] =
                (self.map_from_sensor * nalgebra::Point3::from(offset.map(f64::from))).into();
            point
        })
    }

    /// Bytes of memory.
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>() + self.image.memory_bytes()
    }
}
