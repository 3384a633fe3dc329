//! The lattice: which voxel a point falls in (paper II), at every level (paper III).

use super::key::{INDEX_MAX, INDEX_MIN, VoxelKey};
use crate::geometry::{Point, Pose};

/// Finest resolution a map may have, meters.
pub const RESOLUTION_MIN_M: f64 = 0.001;
/// Coarsest resolution a map may have, meters.
pub const RESOLUTION_MAX_M: f64 = 100.0;
/// Most levels a map may have.
pub const LEVELS_MAX: u32 = 12;

/// Why a number cannot be a lattice's setting.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SettingError {
    /// The resolution is not a number in range.
    #[error("resolution_m must lie in {RESOLUTION_MIN_M}..={RESOLUTION_MAX_M}, got {0}")]
    Resolution(f64),
    /// The number of levels is out of range.
    #[error("levels must lie in 1..={LEVELS_MAX}, got {0}")]
    Levels(u32),
}

/// Cubic lattices of r_n = r_0 * 2^n, n = 0 .. levels - 1, all with a corner at the map's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    resolution_m: f64,
    levels: u32,
}

impl Lattice {
    /// A lattice of finest resolution `resolution_m` (meters) with `levels` levels.
    ///
    /// # Errors
    /// When a number is out of range; the error names it and the range.
    pub fn new(resolution_m: f64, levels: u32) -> Result<Self, SettingError> {
        if !(RESOLUTION_MIN_M..=RESOLUTION_MAX_M).contains(&resolution_m) {
            return Err(SettingError::Resolution(resolution_m));
        }
        if !(1..=LEVELS_MAX).contains(&levels) {
            return Err(SettingError::Levels(levels));
        }
        Ok(Self { resolution_m, levels })
    }

    /// Number of levels; level 0 is the finest.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// Side of a voxel of `level`, meters.
    pub fn resolution_m(&self, level: u32) -> f64 {
        self.resolution_m * f64::from(1u32 << level)
    }

    /// The map-frame range of coordinates a voxel index can hold, meters: (inclusive, exclusive).
    pub fn range_m(&self) -> (f64, f64) {
        (f64::from(INDEX_MIN) * self.resolution_m, (f64::from(INDEX_MAX) + 1.0) * self.resolution_m)
    }

    /// How far apart two places of a map can be, meters.
    pub fn extent_m(&self) -> f64 {
        let (min_m, end_m) = self.range_m();
        (end_m - min_m) * 3f64.sqrt()
    }

    /// Center of voxel `key` of `level` in the map frame, meters.
    pub fn center_m(&self, key: VoxelKey, level: u32) -> [f64; 3] {
        key.index().map(|i| self.center_along_m(i, level))
    }

    /// Center of the voxels of `level` with index `i` along an axis, meters along it.
    pub fn center_along_m(&self, i: i32, level: u32) -> f64 {
        (f64::from(i) + 0.5) * self.resolution_m(level)
    }

    /// The transform from points of a frame placed at `map_from_points` to voxel indices.
    pub fn from_points(&self, map_from_points: &Pose) -> LatticeFromPoints {
        let rotation = map_from_points.rotation.to_rotation_matrix();
        let row = |r: usize| std::array::from_fn(|c| (rotation[(r, c)] / self.resolution_m) as f32);
        let shift = |r: usize| (map_from_points.translation.vector[r] / self.resolution_m) as f32;
        LatticeFromPoints { rotation: std::array::from_fn(row), translation: std::array::from_fn(shift) }
    }

    /// The transform from points of the map frame to voxel indices.
    pub fn from_map(&self) -> LatticeFromPoints {
        self.from_points(&Pose::identity())
    }
}

/// Rotate, translate, quantize (paper II): the one definition of which voxel a point falls in.
///
/// Every path, scalar or wide, computes exactly this in f32, in this order, without fused multiply-add:
/// `q = floor(((r0 * x + r1 * y) + r2 * z) + t)`, with rotation and translation in finest voxels, so that all agree
/// bit for bit. The voxel of level n is `q >> n`: a coarse voxel is exactly the parent of its eight children.
/// (Quantizing each level by itself, as the original code does, lets the levels disagree.)
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatticeFromPoints {
    /// Rows of the rotation matrix over r_0: voxels a meter.
    pub(crate) rotation: [[f32; 3]; 3],
    /// Voxels.
    pub(crate) translation: [f32; 3],
}

impl LatticeFromPoints {
    /// Smallest and one past the largest quantized coordinate, as f32: both are powers of two, so exact.
    pub(crate) const QUANTIZED_MIN: f32 = INDEX_MIN as f32;
    pub(crate) const QUANTIZED_END: f32 = -Self::QUANTIZED_MIN;

    /// The indices of the finest voxel that `point` falls in; none when it is not finite or out of range.
    #[inline(always)]
    pub fn index(&self, point: Point) -> Option<[i32; 3]> {
        let q = self.scaled(point).map(f32::floor);
        // Comparisons with NaN are false, so this refuses what is not finite too.
        let in_range = q.iter().all(|c| (Self::QUANTIZED_MIN..Self::QUANTIZED_END).contains(c));
        in_range.then(|| q.map(|c| c as i32))
    }

    /// The point on the lattice, before it is rounded down.
    #[inline(always)]
    fn scaled(&self, point: Point) -> [f32; 3] {
        let [x, y, z] = point.xyz();
        std::array::from_fn(|axis| {
            let [r0, r1, r2] = self.rotation[axis];
            ((r0 * x + r1 * y) + r2 * z) + self.translation[axis]
        })
    }

    /// The voxel of `level` that `point` falls in, and how far from its center, in whole steps, an even number of which
    /// is its side: from -`steps` / 2 to just below `steps` / 2. None when the point is not finite or out of range.
    pub(super) fn offset(&self, point: Point, level: u32, steps: i64) -> Option<(VoxelKey, [i64; 3])> {
        let index = self.index(point)?.map(|i| i >> level);
        let side = f64::from(1u32 << level);
        let scaled = self.scaled(point);
        let offset = std::array::from_fn(|axis| {
            let from_center = f64::from(scaled[axis]) / side - f64::from(index[axis]) - 0.5;
            ((from_center * steps as f64).round() as i64).min(steps / 2 - 1)
        });
        Some((VoxelKey::pack(index), offset))
    }

    /// The key of the finest voxel that `point` falls in; none when it is not finite or out of range.
    #[inline]
    pub fn key(&self, point: Point) -> Option<VoxelKey> {
        self.index(point).map(VoxelKey::pack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_on_a_border_belongs_to_the_upper_voxel() {
        let quantize = Lattice::new(0.5, 1).unwrap().from_map();
        assert_eq!(quantize.index(Point::new(0.5, -0.5, 0.0)), Some([1, -1, 0]));
        assert_eq!(quantize.index(Point::new(0.49, -0.51, -0.01)), Some([0, -2, -1]));
    }

    #[test]
    fn points_that_no_voxel_holds_have_no_index() {
        let quantize = Lattice::new(1.0, 1).unwrap().from_map();
        let end = 1_048_576.0f32;
        assert_eq!(quantize.index(Point::new(-end, end - 1.0, 0.0)), Some([INDEX_MIN, INDEX_MAX, 0]));
        for bad in [end, -end - 1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(quantize.index(Point::new(0.0, bad, 0.0)), None);
        }
    }

    #[test]
    fn settings_out_of_range_are_named() {
        assert!(Lattice::new(0.0, 4).unwrap_err().to_string().contains("resolution_m"));
        assert!(Lattice::new(f64::NAN, 4).is_err());
        assert!(Lattice::new(0.05, 13).unwrap_err().to_string().contains("levels"));
    }
}
