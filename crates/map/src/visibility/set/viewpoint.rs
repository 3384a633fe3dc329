//! A viewpoint: where a scan was taken, and how far it saw from there.

use std::borrow::Cow;
use std::sync::OnceLock;

use super::coverage::Coverage;
use crate::geometry::{Pose, rotation_xyzw, translation_m};
use crate::util::Digest;
use crate::visibility::directions::TILE_SIDE;
use crate::visibility::image::{Met, RangeImage};

/// Places that a viewpoint met, which scans are compared with.
const MET: usize = 500;

/// Where a scan was taken, and how far it saw in each direction (paper III-B).
#[derive(Debug, Clone, PartialEq)]
pub struct Viewpoint {
    map_from_sensor: Pose,
    image: RangeImage,
    /// Rows of the rotation from the map to the sensor.
    rotation: [[f32; 3]; 3],
    coverage: Coverage,
    met: MetOnce,
}

/// Some of the places that a viewpoint met, off by at most so many meters: found out once, when they are first asked
/// for. They follow from the image.
#[derive(Debug, Clone, Default)]
struct MetOnce(OnceLock<(f32, Box<[Met]>)>);

impl PartialEq for MetOnce {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Most bytes of memory of a viewpoint whose image has at most [`IMAGE_BYTES_MAX`](crate::visibility::IMAGE_BYTES_MAX)
/// bytes: the places of 104 x 104 tiles on each face, and 17 x 17 x 17 cells of an index, read and in a growing list.
pub const VIEWPOINT_MEMORY_MAX: usize = 512 << 10;

impl Viewpoint {
    /// The viewpoint of a scan that was taken at `map_from_sensor`.
    pub fn new(map_from_sensor: Pose, image: RangeImage) -> Self {
        let rotation = map_from_sensor.rotation.inverse().to_rotation_matrix();
        let row = |r: usize| std::array::from_fn(|c| rotation[(r, c)] as f32);
        let coverage = Coverage::of(&map_from_sensor, &image);
        Self { map_from_sensor, image, rotation: std::array::from_fn(row), coverage, met: MetOnce::default() }
    }

    /// Where the scan was taken.
    pub fn map_from_sensor(&self) -> &Pose {
        &self.map_from_sensor
    }

    /// How far it saw, in the sensor frame.
    pub fn image(&self) -> &RangeImage {
        &self.image
    }

    /// Some 500 of the places that the scan met, from all over what it saw, none of which is off by more than
    /// `error_max_m`. Fast where all ask for the same error.
    pub fn met(&self, error_max_m: f32) -> Cow<'_, [Met]> {
        let found_out = || self.image.met(MET, error_max_m);
        let (of_error_m, met) = self.met.0.get_or_init(|| (error_max_m, found_out().into()));
        if *of_error_m == error_max_m { Cow::Borrowed(met) } else { Cow::Owned(found_out()) }
    }

    /// True where the scan saw beyond `point_m` (map frame, meters).
    #[inline]
    pub fn is_free(&self, point_m: [f64; 3]) -> bool {
        self.image.is_free(self.offset(point_m))
    }

    /// The offset of a point of the map from the sensor, in the sensor's frame, meters: computed in one order, so that
    /// it is the same on every machine.
    #[inline(always)]
    pub fn offset(&self, point_m: [f64; 3]) -> [f32; 3] {
        let origin = &self.map_from_sensor.translation.vector;
        let [x, y, z] = std::array::from_fn(|axis| (point_m[axis] - origin[axis]) as f32);
        self.rotation.map(|[r0, r1, r2]| (r0 * x + r1 * y) + r2 * z)
    }

    /// The part of space that it can have seen a point of: boxes of the map frame, each as the smallest and the largest
    /// coordinates, meters.
    pub fn boxes_m(&self) -> impl Iterator<Item = [[f64; 3]; 2]> {
        self.coverage.boxes_m()
    }

    /// Hash of where the scan was taken, and of how far it saw: equal for equal viewpoints.
    pub(super) fn hash(&self) -> u64 {
        let pose = Digest::default()
            .numbers(&translation_m(&self.map_from_sensor))
            .numbers(&rotation_xyzw(&self.map_from_sensor));
        pose.bytes(&self.image.to_bytes()).finish()
    }

    pub(super) fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    /// Bytes of memory, those of its places in an index and of what it met with them.
    pub fn memory_bytes(&self) -> usize {
        let met = MET.min(self.image.tiles.len() * TILE_SIDE * TILE_SIDE) * size_of::<Met>();
        size_of::<Self>() + self.image.memory_bytes() + self.coverage.memory_bytes() + met
    }
}
