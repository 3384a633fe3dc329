//! Which cells are free: something was seen through in each column of voxels.

use std::ops::RangeInclusive;

use super::cells::Cells;
use super::occupancy_grid::Grid;
use super::projection::Projection;
use crate::planning::unknown::{CELLS, FreeSpace};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, Cell, VoxelKey};

/// Blocks that nobody looked into between two checks of the stop signal.
const BLOCKS_PER_STOP_CHECK: usize = 1024;
/// Boxes that viewpoints looked into between two checks of the stop signal.
const BOXES_PER_STOP_CHECK: usize = 4096;
/// Columns of a block.
const COLUMNS: usize = (BLOCK_SIDE * BLOCK_SIDE) as usize;

impl Projection<'_> {
    /// Which cells of `grid`, which are `cells`, are free.
    pub(super) fn free_cells(&self, cells: &Cells, grid: &Grid, stop: StopSignal<'_>) -> Vec<u64> {
        let mut columns = vec![0u32; grid.cells()];
        let mut free_space = FreeSpace::of(self.view);
        let [xs, ys, zs] = self.blocks_in_reach(cells, stop);
        let mut looked = 0;
        'stacks: for (x, y) in xs.flat_map(|x| ys.clone().map(move |y| (x, y))) {
            let mut is_seen = [false; COLUMNS];
            for z in zs.clone() {
                looked += 1;
                if looked % BLOCKS_PER_STOP_CHECK == 0 && stop.is_stopped() {
                    break 'stacks;
                }
                let Some(block) = VoxelKey::new([x, y, z]) else { continue };
                if self.may_be_seen(block) {
                    // A block that many looked into takes a while.
                    if stop.is_stopped() {
                        break 'stacks;
                    }
                    self.look_at(block, &mut is_seen, &mut free_space);
                }
            }
            for (column, _) in is_seen.iter().enumerate().filter(|(_, is_seen)| **is_seen) {
                let at = [column as i64 % i64::from(BLOCK_SIDE), column as i64 / i64::from(BLOCK_SIDE)];
                let cell = |axis: usize| {
                    (i64::from([x, y][axis]) * i64::from(BLOCK_SIDE) + at[axis]).div_euclid(self.cell_voxels)
                };
                if let Some(number) = cells.number([cell(0), cell(1)]) {
                    columns[number] += 1;
                }
            }
        }
        let all = u64::try_from(self.cell_voxels * self.cell_voxels).unwrap_or(u64::MAX);
        let mut free = vec![0u64; grid.cells().div_ceil(64)];
        for (number, &seen) in columns.iter().enumerate() {
            let is_free = u64::from(seen) == all && !grid.is_occupied(number);
            free[number / 64] |= u64::from(is_free) << (number % 64);
        }
        free
    }

    /// Notes the columns of a block that have a free voxel in the band.
    fn look_at(&self, block: VoxelKey, is_seen: &mut [bool; COLUMNS], free_space: &mut FreeSpace<'_>) {
        let occupied = self.view.level_block(self.level, block);
        for cell in (0..CELLS).map(Cell::from_bits).filter(|cell| !occupied.contains(*cell, 0)) {
            let (voxel, [x, y, _]) = (cell.voxel(block), cell.index());
            let column = &mut is_seen[x + y * BLOCK_SIDE as usize];
            if !*column && (self.band[0]..=self.band[1]).contains(&voxel.index()[2]) {
                *column = free_space.is_seen_through(voxel, self.level);
            }
        }
    }

    /// True where a viewpoint may have looked into a block.
    fn may_be_seen(&self, block: VoxelKey) -> bool {
        let side_m = self.voxel_m * f64::from(BLOCK_SIDE);
        let low_m = block.index().map(|i| f64::from(i) * side_m);
        self.view
            .viewpoints()
            .is_some_and(|viewpoints| viewpoints.may_look_into(low_m, low_m.map(|c| c + side_m)))
    }

    /// The blocks of the area and the band, as far as any viewpoint looked: their indices along each axis.
    fn blocks_in_reach(&self, cells: &Cells, stop: StopSignal<'_>) -> [RangeInclusive<i32>; 3] {
        let block =
            |voxel: i64| (voxel >> BLOCK_LEVELS).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        let area = |axis: usize| {
            let [first, end] =
                [cells.first[axis], cells.end[axis]].map(|cell| cell.saturating_mul(self.cell_voxels));
            [block(first), block(end - 1)]
        };
        let bounds = [area(0), area(1), self.band.map(|z| block(z.into()))];
        let (mut low_m, mut high_m) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let boxes_m = self.view.viewpoints().into_iter().flat_map(|viewpoints| viewpoints.boxes_m());
        for [low, high] in stop.paced(boxes_m, BOXES_PER_STOP_CHECK) {
            low_m = std::array::from_fn(|axis| low_m[axis].min(low[axis]));
            high_m = std::array::from_fn(|axis| high_m[axis].max(high[axis]));
        }
        std::array::from_fn(|axis| {
            // A conversion keeps to what a number can hold; without any viewpoint nothing is left.
            let index = |c: f64| block((c / self.voxel_m).floor() as i64);
            index(low_m[axis]).max(bounds[axis][0])..=index(high_m[axis]).min(bounds[axis][1])
        })
    }
}
