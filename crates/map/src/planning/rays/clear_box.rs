//! The empty box around the place where many rays begin: each leaves it in one leap.

use crate::map::CellBounds;
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, Cell};

/// Rays from one place for each block that is looked at to find its box: a look takes as long as a tenth of a step.
const RAYS_PER_BLOCK: usize = 8;

/// Where blocks of voxels are read: the block that holds a cell.
pub(super) trait Blocks {
    /// The voxels of the block that holds `cell`.
    fn around(&mut self, cell: [i32; 3]) -> &BlockMask;
}

/// An axis, and which way along it.
#[derive(Debug, Clone, Copy)]
struct Face {
    axis: usize,
    is_upper: bool,
}

/// All faces of a box.
const FACES: [Face; 6] = {
    let mut faces = [Face { axis: 0, is_upper: false }; 6];
    let mut n = 0;
    while n < 6 {
        faces[n] = Face { axis: n % 3, is_upper: n >= 3 };
        n += 1;
    }
    faces
};

/// The empty box around `cell` for so many rays that begin there: whole blocks first, a layer on each side in turn,
/// then what is empty of the blocks beside it, as whole voxels of `1 << up` cells. It ends where `bounds` do. None
/// where the block that holds `cell` is not empty, or the rays are too few to look for it.
pub(super) fn clear_box(
    blocks: &mut impl Blocks,
    cell: [i32; 3],
    bounds: &CellBounds,
    (rays, up): (usize, u32),
) -> Option<CellBounds> {
    let is_inside = (0..3).all(|axis| (bounds.first[axis]..bounds.end[axis]).contains(&cell[axis]));
    let blocks_max = rays / RAYS_PER_BLOCK;
    if blocks_max == 0 || !is_inside || !blocks.around(cell).is_empty() {
        return None;
    }
    let first = cell.map(|i| i >> BLOCK_LEVELS << BLOCK_LEVELS);
    let mut clear = CellBounds { first, end: first.map(|i| i + BLOCK_SIDE) };
    let mut open = FACES.to_vec();
    while !open.is_empty() {
        open.retain(|face| {
            let beyond = face.layer_beyond(&clear);
            let may_be_more = block_count(&clear) + block_count(&beyond) <= blocks_max;
            let grows = may_be_more && face.lies_within(&clear, bounds) && is_empty(blocks, &beyond);
            if grows {
                face.move_out(&mut clear, BLOCK_SIDE);
            }
            grows
        });
    }
    for face in FACES {
        if !face.lies_within(&clear, bounds) {
            continue;
        }
        let cells = face.empty_cells(&occupied(blocks, &face.layer_beyond(&clear)));
        face.move_out(&mut clear, cells >> up << up);
    }
    Some(clear)
}

impl Face {
    /// True where there is something within `bounds` beyond the face.
    fn lies_within(self, clear: &CellBounds, bounds: &CellBounds) -> bool {
        match self.is_upper {
            true => clear.end[self.axis] < bounds.end[self.axis],
            false => clear.first[self.axis] > bounds.first[self.axis],
        }
    }

    /// The layer of cells, as thick as a block, that the face looks at.
    fn layer_beyond(self, clear: &CellBounds) -> CellBounds {
        let (mut layer, axis) = (*clear, self.axis);
        match self.is_upper {
            true => (layer.first[axis], layer.end[axis]) = (clear.end[axis], clear.end[axis] + BLOCK_SIDE),
            false => {
                (layer.first[axis], layer.end[axis]) = (clear.first[axis] - BLOCK_SIDE, clear.first[axis]);
            }
        }
        layer
    }

    fn move_out(self, clear: &mut CellBounds, cells: i32) {
        match self.is_upper {
            true => clear.end[self.axis] += cells,
            false => clear.first[self.axis] -= cells,
        }
    }

    /// Layers of a block without an occupied cell, from the side on that is next to the face.
    fn empty_cells(self, occupied: &BlockMask) -> i32 {
        let away = |cell: Cell| {
            let index = cell.index()[self.axis] as i32;
            if self.is_upper { index } else { BLOCK_SIDE - 1 - index }
        };
        occupied.cells(0).map(away).min().unwrap_or(BLOCK_SIDE)
    }
}

/// Number of blocks in which a box has cells.
fn block_count(of: &CellBounds) -> usize {
    let along = |axis: usize| (of.end[axis] - of.first[axis] + BLOCK_SIDE - 1) >> BLOCK_LEVELS;
    (0..3).map(|axis| along(axis) as usize).product()
}

/// A cell of each block in which a box has cells.
fn block_cells(of: &CellBounds) -> impl Iterator<Item = [i32; 3]> + use<> {
    let along = |axis: usize| of.first[axis] >> BLOCK_LEVELS..((of.end[axis] - 1) >> BLOCK_LEVELS) + 1;
    let [xs, ys, zs] = [0, 1, 2].map(along);
    let blocks = zs.flat_map(move |z| {
        let xs = xs.clone();
        ys.clone().flat_map(move |y| xs.clone().map(move |x| [x, y, z]))
    });
    blocks.map(|block| block.map(|i| i << BLOCK_LEVELS))
}

/// True where all blocks in which a box has cells are empty.
fn is_empty(blocks: &mut impl Blocks, of: &CellBounds) -> bool {
    block_cells(of).all(|cell| blocks.around(cell).is_empty())
}

/// The occupied cells of a box, as one block: those of all blocks, one upon the other.
fn occupied(blocks: &mut impl Blocks, of: &CellBounds) -> BlockMask {
    let mut all = BlockMask::EMPTY;
    for first in block_cells(of) {
        let mask = *blocks.around(first);
        let is_within = |axis: usize, i: i32| (of.first[axis]..of.end[axis]).contains(&i);
        if (0..3).all(|axis| is_within(axis, first[axis]) && is_within(axis, first[axis] + BLOCK_SIDE - 1)) {
            all = all.union(&mask);
            continue;
        }
        let is_inside =
            |index: [usize; 3]| (0..3).all(|axis| is_within(axis, first[axis] + index[axis] as i32));
        mask.cells(0).filter(|cell| is_inside(cell.index())).for_each(|cell| {
            all.insert(cell);
        });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::VoxelKey;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// Blocks of some occupied cells.
    struct FewBlocks(BTreeMap<VoxelKey, BlockMask>);

    impl FewBlocks {
        fn of(cells: impl IntoIterator<Item = [i32; 3]>) -> Self {
            let mut blocks = BTreeMap::new();
            for index in cells {
                let (block, cell) = Cell::of(index);
                blocks.entry(block).or_insert(BlockMask::EMPTY).insert(cell);
            }
            Self(blocks)
        }
    }

    impl Blocks for FewBlocks {
        fn around(&mut self, cell: [i32; 3]) -> &BlockMask {
            self.0.get(&Cell::of(cell).0).unwrap_or(&BlockMask::EMPTY)
        }
    }

    const BOUNDS: CellBounds = CellBounds { first: [-64; 3], end: [64; 3] };

    #[test]
    fn in_an_empty_room_it_is_all_that_lies_between_the_walls() {
        let (low, high) = ([-21, -9, -30], [37, 18, 5]);
        let index = |n: i32| [n % 128 - 64, n / 128 % 128 - 64, n / (128 * 128) - 64];
        let is_wall = |i: &[i32; 3]| {
            let is_inside = (0..3).all(|axis| (low[axis]..=high[axis]).contains(&i[axis]));
            is_inside && (0..3).any(|axis| i[axis] == low[axis] || i[axis] == high[axis])
        };
        let mut room = FewBlocks::of((0..128 * 128 * 128).map(index).filter(is_wall));
        let found = clear_box(&mut room, [2, 3, -7], &BOUNDS, (100_000, 0)).unwrap();
        assert_eq!((found.first, found.end), (low.map(|i| i + 1), high));
        assert_eq!(clear_box(&mut room, [2, 3, -7], &BOUNDS, (RAYS_PER_BLOCK - 1, 0)), None, "too few rays");
        assert_eq!(clear_box(&mut room, [2, 16, -7], &BOUNDS, (100_000, 0)), None, "beside a wall");
        assert_eq!(clear_box(&mut room, [64, 0, 0], &BOUNDS, (100_000, 0)), None, "beyond the bounds");
    }

    proptest! {
        #[test]
        fn it_holds_the_cell_and_nothing_occupied(
            occupied in prop::collection::vec(prop::array::uniform3(-64i32..64), 0..60),
            cell in prop::array::uniform3(-64i32..64),
            rays in prop_oneof![0usize..200, Just(1_000_000)],
            up in 0u32..3,
        ) {
            let mut blocks = FewBlocks::of(occupied.iter().copied());
            let found = clear_box(&mut blocks, cell, &BOUNDS, (rays, up));
            let stands_free = blocks.around(cell).is_empty() && rays >= RAYS_PER_BLOCK;
            prop_assert_eq!(found.is_some(), stands_free);
            if let Some(clear) = found {
                let holds = |of: &CellBounds, cell: [i32; 3]| (0..3).all(|axis| (of.first[axis]..of.end[axis]).contains(&cell[axis]));
                prop_assert!(holds(&clear, cell));
                for axis in 0..3 {
                    prop_assert!(BOUNDS.first[axis] <= clear.first[axis] && clear.end[axis] <= BOUNDS.end[axis]);
                    prop_assert_eq!([clear.first[axis], clear.end[axis]].map(|i| i & ((1 << up) - 1)), [0, 0]);
                }
                // Whole voxels of the level count.
                prop_assert!(!occupied.iter().any(|&i| holds(&clear, i.map(|i| i >> up << up))));
            }
        }
    }
}
