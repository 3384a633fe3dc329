//! Grids: boxes of voxels, and the offset of each voxel in an array.

use mrol_map::voxel::VoxelKey;

/// A box of voxels of one level, of less than 2^32 cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Index of the first voxel, along x, y and z.
    pub min: [i32; 3],
    /// Number of voxels along x, y and z.
    pub size: [u32; 3],
}

impl Grid {
    /// The smallest box around `voxels`; none without a voxel.
    pub fn around(voxels: impl IntoIterator<Item = VoxelKey>) -> Option<Self> {
        let mut voxels = voxels.into_iter().map(VoxelKey::index);
        let first = voxels.next()?;
        let (min, max) = voxels.fold((first, first), |(min, max), index| {
            let each = |pick: fn(i32, i32) -> i32, a: [i32; 3]| std::array::from_fn(|k| pick(a[k], index[k]));
            (each(Ord::min, min), each(Ord::max, max))
        });
        Some(Self { min, size: std::array::from_fn(|k| max[k].abs_diff(min[k]) + 1) })
    }

    /// Number of cells.
    pub fn cells(&self) -> u64 {
        self.size.iter().map(|&size| u64::from(size)).product()
    }

    /// Offset of the voxel at `index`, x first, then y, then z; [`Grid::cells`] for one that is outside.
    #[inline(always)]
    pub fn offset(&self, index: [i32; 3]) -> u32 {
        let [x, y, z]: [u32; 3] = std::array::from_fn(|k| index[k].wrapping_sub(self.min[k]) as u32);
        let inside = x < self.size[0] && y < self.size[1] && z < self.size[2];
        let offset = z.wrapping_mul(self.size[1]).wrapping_add(y).wrapping_mul(self.size[0]).wrapping_add(x);
        if inside { offset } else { self.cells() as u32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_a_cell_for_each_of_its_voxels_and_one_for_all_others() {
        let voxels = [[-3, 5, 0], [1, 5, 2], [0, 4, 1]].map(|index| VoxelKey::new(index).unwrap());
        let grid = Grid::around(voxels).unwrap();
        assert_eq!((grid.min, grid.size, grid.cells()), ([-3, 4, 0], [5, 2, 3], 30));
        let cells = (0..3).flat_map(|z| (4..6).flat_map(move |y| (-3..2).map(move |x| [x, y, z])));
        assert!(cells.map(|index| grid.offset(index)).eq(0..30));
        for outside in [[-4, 5, 0], [2, 5, 0], [0, 3, 0], [0, 5, -1], [i32::MAX, i32::MIN, 0]] {
            assert_eq!(grid.offset(outside), 30);
        }
        assert_eq!(Grid::around([]), None);
    }
}
