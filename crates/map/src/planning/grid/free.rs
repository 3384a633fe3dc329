//! Which cells are free: something was seen through in each column of voxels.

use std::ops::RangeInclusive;

use super::cells::Cells;
use super::occupancy_grid::Grid;
use super::projection::{COLUMNS, Projection};
use crate::map::{MapView, PausingView};
use crate::planning::unknown::{CELLS, FreeSpace};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, Cell, VoxelKey};

/// Blocks that nobody looked into between two checks of the stop signal.
const BLOCKS_PER_STOP_CHECK: usize = 1024;
/// Boxes that viewpoints looked into between two checks of the stop signal.
const BOXES_PER_STOP_CHECK: usize = 4096;

/// What is looked at with, for as long as nobody else is to go first.
struct Look<'a> {
    view: &'a MapView<'a>,
    free_space: FreeSpace<'a>,
    stop: StopSignal<'a>,
}

/// How many blocks were looked at.
struct Looks(usize);

impl Projection<'_> {
    /// Which cells of `grid`, which are `cells`, are free. Others go first between the stacks of blocks.
    pub(super) fn free_cells(
        &self,
        view: &mut PausingView<'_>,
        cells: &Cells,
        grid: &Grid,
        stop: StopSignal<'_>,
    ) -> Vec<u64> {
        let mut columns = vec![0u32; grid.cells()];
        let [xs, ys, zs] = self.blocks_in_reach(view.view(), cells, stop);
        let mut stacks = xs.flat_map(|x| ys.clone().map(move |y| [x, y])).peekable();
        let mut looks = Looks(0);
        while stacks.peek().is_some() {
            view.give_way(stop);
            let mut look = Look { view: view.view(), free_space: FreeSpace::of(view.view()), stop };
            for stack in stacks.by_ref() {
                let Some(is_seen) = self.look_at_stack(stack, zs.clone(), &mut look, &mut looks) else {
                    return self.free_of(&columns, grid);
                };
                for (column, _) in is_seen.iter().enumerate().filter(|(_, is_seen)| **is_seen) {
                    if let Some(number) = cells.number(self.cell_of(stack, column)) {
                        columns[number] += 1;
                    }
                }
                if stop.is_way_due() {
                    break;
                }
            }
        }
        self.free_of(&columns, grid)
    }

    /// The cell that a column of a stack of blocks lies in.
    fn cell_of(&self, stack: [i32; 2], column: usize) -> [i64; 2] {
        let at = [column as i64 % i64::from(BLOCK_SIDE), column as i64 / i64::from(BLOCK_SIDE)];
        std::array::from_fn(|axis| {
            (i64::from(stack[axis]) * i64::from(BLOCK_SIDE) + at[axis]).div_euclid(self.cell_voxels)
        })
    }

    /// The columns of a stack of blocks that have a free voxel in the band; none once stopped.
    fn look_at_stack(
        &self,
        [x, y]: [i32; 2],
        zs: RangeInclusive<i32>,
        look: &mut Look<'_>,
        Looks(looks): &mut Looks,
    ) -> Option<[bool; COLUMNS]> {
        let mut is_seen = [false; COLUMNS];
        let mut bases = None;
        for z in zs {
            *looks += 1;
            if looks.is_multiple_of(BLOCKS_PER_STOP_CHECK) && look.stop.is_stopped() {
                return None;
            }
            let Some(block) = VoxelKey::new([x, y, z]) else { continue };
            if self.may_be_seen(look.view, block) {
                // A block that many looked into takes a while.
                if look.stop.is_stopped() {
                    return None;
                }
                let bases = bases.get_or_insert_with(|| self.bases([x, y]));
                self.look_at(block, bases, &mut is_seen, look);
            }
        }
        Some(is_seen)
    }

    /// What the band counts from in the columns of a stack of blocks.
    fn bases(&self, stack: [i32; 2]) -> [i32; COLUMNS] {
        let [x, y] = stack.map(|i| i.saturating_mul(BLOCK_SIDE));
        let place = |column: usize| [column as i32 % BLOCK_SIDE, column as i32 / BLOCK_SIDE];
        std::array::from_fn(|column| {
            let [dx, dy] = place(column);
            self.base([x.saturating_add(dx), y.saturating_add(dy)]).height
        })
    }

    /// The cells of which all columns are free, by how many are.
    fn free_of(&self, columns: &[u32], grid: &Grid) -> Vec<u64> {
        let all = u64::try_from(self.cell_voxels * self.cell_voxels).unwrap_or(u64::MAX);
        let mut free = vec![0u64; grid.cells().div_ceil(64)];
        for (number, &seen) in columns.iter().enumerate() {
            let is_free = u64::from(seen) == all && !grid.is_occupied(number);
            free[number / 64] |= u64::from(is_free) << (number % 64);
        }
        free
    }

    /// Notes the columns of a block that have a free voxel in the band.
    fn look_at(
        &self,
        block: VoxelKey,
        bases: &[i32; COLUMNS],
        is_seen: &mut [bool; COLUMNS],
        look: &mut Look<'_>,
    ) {
        let occupied = look.view.level_block(self.level, block);
        for cell in (0..CELLS).map(Cell::from_bits).filter(|cell| !occupied.contains(*cell, 0)) {
            let (voxel, [x, y, _]) = (cell.voxel(block), cell.index());
            let number = x + y * BLOCK_SIDE as usize;
            let column = &mut is_seen[number];
            if !*column && self.is_in_band(voxel.index()[2], bases[number]) {
                *column = look.free_space.is_seen_through(voxel, self.level);
            }
        }
    }

    /// True where a viewpoint may have looked into a block.
    fn may_be_seen(&self, view: &MapView<'_>, block: VoxelKey) -> bool {
        let side_m = self.voxel_m * f64::from(BLOCK_SIDE);
        let low_m = block.index().map(|i| f64::from(i) * side_m);
        view.viewpoints().is_some_and(|viewpoints| viewpoints.may_cover(low_m, low_m.map(|c| c + side_m)))
    }

    /// The blocks of the area and the band, as far as any viewpoint looked: their indices along each axis.
    fn blocks_in_reach(
        &self,
        view: &MapView<'_>,
        cells: &Cells,
        stop: StopSignal<'_>,
    ) -> [RangeInclusive<i32>; 3] {
        let block =
            |voxel: i64| (voxel >> BLOCK_LEVELS).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        let area = |axis: usize| {
            let [first, end] =
                [cells.first[axis], cells.end[axis]].map(|cell| cell.saturating_mul(self.cell_voxels));
            [block(first), block(end - 1)]
        };
        let bounds = [area(0), area(1), self.heights().map(block)];
        let (mut low_m, mut high_m) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let boxes_m = view.viewpoints().into_iter().flat_map(|viewpoints| viewpoints.boxes_m());
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
