//! The transform: row by row, layer by layer.

use std::num::NonZeroU8;

use super::cap::margin_of;
use super::layer::Layer;
use super::rows::Rows;
use crate::map::regions::CellBox;
use crate::util::StopSignal;
use crate::voxel::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, Cell, VoxelKey, VoxelSet};

/// Squares that are compared between two looks at the stop signal: some milliseconds.
pub(super) const STEPS_PER_STOP_CHECK: usize = 4 << 20;

/// A transform of one box, of at least one cell.
#[derive(Debug)]
pub(super) struct Transform<'a> {
    origin: [i32; 3],
    size: [usize; 3],
    margin: usize,
    stop: StopSignal<'a>,
}

impl<'a> Transform<'a> {
    pub(super) fn new(cells: &CellBox, cap: NonZeroU8, stop: StopSignal<'a>) -> Self {
        let margin = margin_of(cap).unsigned_abs() as usize;
        Self { origin: cells.min(), size: cells.size(), margin, stop }
    }

    /// The squares of the distances within each layer along z, those around the box among them: row y of layer z is row
    /// `z * size[1] + y`.
    pub(super) fn along_x_and_y(&self, voxels: &VoxelSet) -> Option<Rows> {
        let [xs, ys, zs] = self.size;
        let (both_margins, masks) = (2 * self.margin, masks_of_layers());
        let mut layers = Rows::far((zs + both_margins) * ys, xs);
        let mut layer = Layer::empty(ys + both_margins, xs, self.margin);
        for z in 0..zs + both_margins {
            let index = self.origin[2] + z as i32 - self.margin as i32;
            layer.clear();
            for (block, mask) in blocks_of_layer(voxels, index) {
                let part = mask.intersection(&masks[(index & (BLOCK_SIDE - 1)) as usize]);
                self.occupy(&mut layer, *block, &part);
            }
            let rows = layer.measured();
            for y in self.in_parts(0..ys) {
                layers.lower(z * ys + y, rows, y..=y + both_margins, |row| row);
            }
            if self.stop.is_stopped() {
                return None;
            }
        }
        Some(layers)
    }

    /// The distances, of the squares within the layers, by `quarters`.
    pub(super) fn along_z(&self, layers: &Rows, quarters: &[u8], distances: &mut [u8]) -> Option<()> {
        let [xs, ys, zs] = self.size;
        // Those of the same y together: they look at the same rows, which are then near.
        let rows = (0..ys).flat_map(|y| (0..zs).map(move |z| (y, z)));
        let mut least = Rows::far(1, xs);
        for (y, z) in self.in_parts(rows) {
            least.clear(0);
            least.lower(0, layers, z..=z + 2 * self.margin, |layer| layer * ys + y);
            let row = &mut distances[(z * ys + y) * xs..][..xs];
            for (distance, square) in row.iter_mut().zip(least.row(0)) {
                *distance = quarters[usize::from(square.unsigned_abs())];
            }
        }
        (!self.stop.is_stopped()).then_some(())
    }

    /// The rows, with a look at the signal before the first and before every so many more, where others go first; they
    /// end once stopped. No lock is held meanwhile.
    fn in_parts<I: Iterator>(&self, rows: I) -> impl Iterator<Item = I::Item> {
        let per_look = (STEPS_PER_STOP_CHECK / (self.size[0] * (2 * self.margin + 1))).max(1);
        let stop = self.stop;
        let goes_on = move |at: usize| {
            if !at.is_multiple_of(per_look) {
                return true;
            }
            stop.give_way();
            !stop.is_stopped()
        };
        rows.enumerate().take_while(move |(at, _)| goes_on(*at)).map(|(_, row)| row)
    }

    /// Occupies the voxels of a part of a block.
    fn occupy(&self, layer: &mut Layer, block: VoxelKey, part: &BlockMask) {
        for cell in part.cells(0) {
            let index = cell.voxel(block).index();
            let place = |axis: usize| {
                usize::try_from(index[axis] - self.origin[axis] + self.margin as i32).unwrap_or(usize::MAX)
            };
            layer.occupy(place(0), place(1));
        }
    }
}

/// The cells of a block with each index along z.
fn masks_of_layers() -> [BlockMask; BLOCK_SIDE as usize] {
    let mut masks = [BlockMask::EMPTY; BLOCK_SIDE as usize];
    for (z, mask) in (0..).zip(&mut masks) {
        for place in 0..BLOCK_SIDE * BLOCK_SIDE {
            mask.insert(Cell::of([place % BLOCK_SIDE, place / BLOCK_SIDE, z]).1);
        }
    }
    masks
}

/// The blocks that voxels with index `z` lie in: they follow each other, since z is highest in a key.
fn blocks_of_layer(voxels: &VoxelSet, z: i32) -> &[(VoxelKey, BlockMask)] {
    let (blocks, z) = (voxels.blocks(), z >> BLOCK_LEVELS);
    let first = VoxelKey::pack([0, 0, z]);
    let blocks = &blocks[blocks.partition_point(|(block, _)| *block < first)..];
    &blocks[..blocks.partition_point(|(block, _)| block.index()[2] == z)]
}
