//! The array, and look-ups in it.

use super::grid::Grid;
use super::offsets::offsets;
use crate::rivals::structure::{CHUNK, Structure, bits, voxels};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::MultiResolutionMap;
use mrol_map::voxel::Lattice;

/// Most bytes of an array.
pub const DENSE_BYTES_MAX: u64 = 4 << 30;
const _: () = assert!(DENSE_BYTES_MAX <= 1 << 32, "offsets are u32");

/// A dense array: a byte for each voxel of the bounding box of the occupied ones, x first, then y, then z, and one more
/// byte for all that is outside, so that no point needs a branch.
#[derive(Debug)]
pub struct Dense {
    cells: Vec<u8>,
    grid: Grid,
    lattice: Lattice,
    level: u32,
}

/// An array over the bounding box would be too large; the payload is its size, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a byte for each voxel of the bounding box would take {0} bytes, the limit is {DENSE_BYTES_MAX}")]
pub struct DenseTooLarge(pub u128);

impl Dense {
    /// Builds the array of the occupied voxels of `level` of a map.
    ///
    /// # Errors
    /// When the array would take more than [`DENSE_BYTES_MAX`].
    pub fn of(map: &MultiResolutionMap, level: u32) -> Result<Self, DenseTooLarge> {
        let view = map.view();
        let grid = Grid::around(voxels(&view, level)).unwrap_or(Grid { min: [0; 3], size: [0; 3] });
        let bytes = grid.size.iter().map(|&size| u128::from(size)).product::<u128>() + 1;
        if bytes > u128::from(DENSE_BYTES_MAX) {
            return Err(DenseTooLarge(bytes));
        }
        let mut cells = vec![0; bytes as usize];
        voxels(&view, level).for_each(|voxel| cells[grid.offset(voxel.index()) as usize] = 1);
        Ok(Self { cells, grid, lattice: *map.lattice(), level })
    }

    /// The grid of the array.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Looks up `offsets`: point i is bit i % 64 of `occupied[i / 64]`.
    #[inline(always)]
    pub fn contains(&self, offsets: &[u32], occupied: &mut [u64]) {
        bits(offsets, occupied, |&offset| self.cells[offset as usize] != 0);
    }
}

impl Structure for Dense {
    fn occupied(&self, points: &[Point], map_from_points: &Pose, occupied: &mut [u64]) {
        let quantize = self.lattice.from_points(map_from_points);
        let mut chunk = [0; CHUNK];
        for (points, words) in points.chunks(CHUNK).zip(occupied.chunks_mut(CHUNK / 64)) {
            let chunk = &mut chunk[..points.len()];
            offsets(points, &quantize, self.level, &self.grid, chunk);
            self.contains(chunk, words);
        }
    }

    fn bytes(&self) -> usize {
        self.cells.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::{MapContents, MapSettings};
    use mrol_map::voxel::VoxelKey;

    #[test]
    fn an_array_that_would_not_fit_is_refused_with_its_size() {
        let voxels = [[0; 3], [9999; 3]].into_iter().filter_map(VoxelKey::new).collect();
        let contents = MapContents::at(1, voxels);
        let map = MultiResolutionMap::restore(MapSettings::new(0.1, 1), contents).unwrap();
        assert_eq!(Dense::of(&map, 0).unwrap_err(), DenseTooLarge(1_000_000_000_001));
    }

    #[test]
    fn an_empty_map_has_an_array_too() {
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 1)).unwrap();
        let mut occupied = [1];
        Dense::of(&map, 0).unwrap().occupied(&[Point::new(0.0, 0.0, 0.0)], &Pose::identity(), &mut occupied);
        assert_eq!(occupied, [0]);
    }
}
