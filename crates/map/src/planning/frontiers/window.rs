//! The voxels of a box as bits, with those around it: which are free, and which unknown.

use super::clusters::{Bits, Cluster, FrontierBits};
use super::frontier::Frontier;
use super::view_pose::Lookout;
use crate::map::{KeepOut, MapView, PausingView};
use crate::planning::unknown::{ALL, FreeSpace};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, Cell, INDEX_MAX, INDEX_MIN, Lattice, VoxelKey};

/// Blocks between two checks of the stop signal.
const BLOCKS_PER_STOP_CHECK: usize = 16;

/// The voxels of a box and one more on each side.
#[derive(Debug)]
pub(super) struct Window<'a> {
    lattice: &'a Lattice,
    level: u32,
    /// The voxel of place 0: one before the first of the box along each axis.
    first: [i32; 3],
    /// Voxels along each axis.
    size: [usize; 3],
    free: Bits,
    unknown: Bits,
}

/// A range of indices, as far as the lattice of a level goes.
pub(super) fn within_lattice([first, last]: [i32; 2], level: u32) -> [i32; 2] {
    [first.max(INDEX_MIN >> level), last.min(INDEX_MAX >> level)]
}

impl<'a> Window<'a> {
    /// What is known of the voxels of `level` in `ranges` of indices and around them; of some of them once stopped.
    ///
    /// Others go first between its parts.
    pub(super) fn of(
        view: &mut PausingView<'a>,
        level: u32,
        ranges: [[i32; 2]; 3],
        stop: StopSignal<'_>,
    ) -> Self {
        let is_empty = ranges.iter().any(|[first, last]| first > last);
        let size = ranges.map(|[first, last]| if is_empty { 0 } else { (last - first + 3) as usize });
        let count = size.iter().product();
        let first = ranges.map(|[first, _]| first.saturating_sub(1));
        let (free, unknown) = (Bits::new(count), Bits::new(count));
        let mut window = Self { lattice: view.lattice(), level, first, size, free, unknown };
        if !is_empty {
            window.fill(view, ranges, stop);
        }
        window
    }

    fn fill(&mut self, view: &mut PausingView<'_>, ranges: [[i32; 2]; 3], stop: StopSignal<'_>) {
        let around = ranges.map(|[first, last]| {
            within_lattice([first.saturating_sub(1), last.saturating_add(1)], self.level)
        });
        let [xs, ys, zs] = around.map(|[first, last]| first >> BLOCK_LEVELS..=last >> BLOCK_LEVELS);
        let blocks = zs.flat_map(|z| {
            ys.clone().flat_map({
                let xs = xs.clone();
                move |y| xs.clone().map(move |x| [x, y, z])
            })
        });
        let mut blocks = blocks.peekable();
        while blocks.peek().is_some() && !stop.is_stopped() {
            view.give_way(stop);
            let view = view.view();
            let mut free_space = FreeSpace::of(view);
            for block in blocks.by_ref().take(BLOCKS_PER_STOP_CHECK).filter_map(VoxelKey::new) {
                self.fill_block(view, block, around, &mut free_space);
            }
        }
    }

    fn fill_block(
        &mut self,
        view: &MapView<'_>,
        block: VoxelKey,
        around: [[i32; 2]; 3],
        free_space: &mut FreeSpace<'_>,
    ) {
        let occupied = view.level_block(self.level, block);
        let inside = part_inside(block, around);
        let outside = ALL.difference(&inside);
        let seen = free_space.seen_through(self.level, block, &occupied.union(&outside));
        let keep_outs = self.keep_outs_at(view, block);
        for cell in inside.difference(&occupied).cells(0) {
            let voxel = cell.voxel(block);
            let center_m = self.lattice.center_m(voxel, self.level);
            // Keep-outs are occupied.
            if keep_outs.iter().any(|keep_out| keep_out.shape.contains(center_m)) {
                continue;
            }
            let place = self.place(voxel.index());
            if seen.contains(cell, 0) { self.free.set(place) } else { self.unknown.set(place) }
        }
    }

    /// The keep-outs that may hold the center of a voxel of a block.
    fn keep_outs_at<'v>(&self, view: &'v MapView<'_>, block: VoxelKey) -> Vec<&'v KeepOut> {
        let side_m = self.lattice.resolution_m(self.level) * f64::from(BLOCK_SIDE);
        let low_m = block.index().map(|i| f64::from(i) * side_m);
        let meets = |keep_out: &&KeepOut| {
            let (min_m, max_m) = keep_out.shape.bounds_m();
            (0..3).all(|axis| min_m[axis] <= low_m[axis] + side_m && max_m[axis] >= low_m[axis])
        };
        view.keep_outs().into_iter().flat_map(|keep_outs| keep_outs.iter()).filter(meets).collect()
    }

    /// The place of a voxel, x fastest.
    fn place(&self, index: [i32; 3]) -> usize {
        let [x, y, z] = std::array::from_fn(|axis| (index[axis] - self.first[axis]) as usize);
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// The index of the voxel at a place.
    fn index(&self, place: usize) -> [i32; 3] {
        let [x, y, z] =
            [place % self.size[0], place / self.size[0] % self.size[1], place / self.size[0] / self.size[1]];
        let at = [x, y, z];
        std::array::from_fn(|axis| self.first[axis] + at[axis] as i32)
    }

    /// The places beside one along the axes, of a voxel that is not at the window's rim.
    fn beside(&self, place: usize) -> [(usize, [i32; 3]); 6] {
        let strides = [1, self.size[0], self.size[0] * self.size[1]];
        std::array::from_fn(|side| {
            let (axis, sign) = (side / 2, if side % 2 == 0 { 1 } else { -1 });
            let mut step = [0; 3];
            step[axis] = sign;
            (place.wrapping_add_signed(strides[axis] as isize * sign as isize), step)
        })
    }

    /// The voxels of the box that are free with an unknown one beside them. Others go first between its layers.
    pub(super) fn frontier(&self, view: &mut PausingView<'_>, stop: StopSignal<'_>) -> FrontierBits {
        let mut frontier = Bits::new(self.size.iter().product());
        let inside = |axis: usize| 1..self.size[axis].saturating_sub(1);
        for (z, y) in inside(2).flat_map(|z| inside(1).map(move |y| (z, y))) {
            if y == 1 {
                view.give_way(stop);
            }
            for x in inside(0) {
                let place = (z * self.size[1] + y) * self.size[0] + x;
                let is_frontier = self.free.get(place)
                    && self.beside(place).iter().any(|(beside, _)| self.unknown.get(*beside));
                if is_frontier {
                    frontier.set(place);
                }
            }
        }
        FrontierBits::new(frontier, [self.size[0], self.size[0] * self.size[1]])
    }

    /// A cluster as it is told, with a place from which it can be seen.
    pub(super) fn told(&self, cluster: &Cluster, lookout: &Lookout<'_>) -> Frontier {
        let voxel_m = self.lattice.resolution_m(self.level);
        let (mut sum, mut low, mut high, mut outward) = ([0i64; 3], [i32::MAX; 3], [i32::MIN; 3], [0i64; 3]);
        for &place in cluster {
            let index = self.index(place as usize);
            for axis in 0..3 {
                sum[axis] += i64::from(index[axis]);
                (low[axis], high[axis]) = (low[axis].min(index[axis]), high[axis].max(index[axis]));
            }
            for (_, step) in
                self.beside(place as usize).iter().filter(|(beside, _)| self.unknown.get(*beside))
            {
                (0..3).for_each(|axis| outward[axis] += i64::from(step[axis]));
            }
        }
        let count = cluster.len() as f64;
        let mean = sum.map(|sum| sum as f64 / count);
        let squared = |place: &u32| {
            let index = self.index(*place as usize);
            (0..3).map(|axis| (f64::from(index[axis]) - mean[axis]).powi(2)).sum::<f64>()
        };
        // Of several as near the first.
        let middle = cluster.iter().min_by(|a, b| squared(a).total_cmp(&squared(b)).then(a.cmp(b)));
        let view = middle.and_then(|middle| {
            let target = VoxelKey::new(self.index(*middle as usize))?;
            lookout.find(self.lattice.center_m(target, self.level), outward.map(|c| c as f64))
        });
        Frontier {
            voxels: cluster.len() as u64,
            center_m: mean.map(|c| (c + 0.5) * voxel_m),
            min_m: low.map(|i| f64::from(i) * voxel_m),
            max_m: high.map(|i| (f64::from(i) + 1.0) * voxel_m),
            view,
        }
    }
}

/// The voxels of a block that lie in ranges of indices.
fn part_inside(block: VoxelKey, ranges: [[i32; 2]; 3]) -> BlockMask {
    let low = block.index().map(|i| i << BLOCK_LEVELS);
    let is_whole =
        (0..3).all(|axis| ranges[axis][0] <= low[axis] && low[axis] + BLOCK_SIDE - 1 <= ranges[axis][1]);
    if is_whole {
        return ALL;
    }
    let mut inside = BlockMask::EMPTY;
    let is_inside = |cell: &Cell| {
        let index = cell.voxel(block).index();
        (0..3).all(|axis| (ranges[axis][0]..=ranges[axis][1]).contains(&index[axis]))
    };
    ALL.cells(0).filter(is_inside).for_each(|cell| {
        inside.insert(cell);
    });
    inside
}
