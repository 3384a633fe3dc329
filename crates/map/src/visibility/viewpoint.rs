//! A viewpoint: where a scan was taken, and how far it saw from there.

use super::range_image::RangeImage;
use super::reach::Reach;
use crate::geometry::Pose;

/// Where a scan was taken, and how far it saw in each direction (paper III-B).
#[derive(Debug, Clone, PartialEq)]
pub struct Viewpoint {
    map_from_sensor: Pose,
    image: RangeImage,
    /// Rows of the rotation from the map to the sensor.
    rotation: [[f32; 3]; 3],
    reach: Reach,
}

/// Most bytes of memory of a viewpoint whose image has at most [`IMAGE_BYTES_MAX`](super::IMAGE_BYTES_MAX) bytes: the places of
/// 104 x 104 tiles on each face, and 17 x 17 x 17 cells of an index, read and in a growing list.
pub const VIEWPOINT_MEMORY_MAX: usize = 512 << 10;

impl Viewpoint {
    /// The viewpoint of a scan that was taken at `map_from_sensor`.
    pub fn new(map_from_sensor: Pose, image: RangeImage) -> Self {
        let rotation = map_from_sensor.rotation.inverse().to_rotation_matrix();
        let row = |r: usize| std::array::from_fn(|c| rotation[(r, c)] as f32);
        let reach = Reach::of(&map_from_sensor, &image);
        Self { map_from_sensor, image, rotation: std::array::from_fn(row), reach }
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

    /// The part of space that it can have seen a point of: boxes of the map frame, each as the smallest and the largest
    /// coordinates, meters.
    pub fn boxes_m(&self) -> impl Iterator<Item = [[f64; 3]; 2]> {
        self.reach.boxes_m()
    }

    pub(super) fn reach(&self) -> &Reach {
        &self.reach
    }

    /// Bytes of memory, those of its places in an index with them.
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>() + self.image.memory_bytes() + self.reach.memory_bytes()
    }
}
