//! The voxels of a band of height, projected on cells.

use super::cells::{Cells, whole};
use super::floor::{Floor, Height};
use super::occupancy_grid::Grid;
use super::request::{GridArea, GridError, GridRequest};
use crate::map::{PausingView, Region, SHARDS, VoxelSelection};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_SIDE, BlockMask, INDEX_MAX, INDEX_MIN, Lattice, VoxelKey};

/// Columns of a block.
pub(super) const COLUMNS: usize = (BLOCK_SIDE * BLOCK_SIDE) as usize;

/// A request that was checked.
pub(super) struct Projection<'a> {
    pub(super) level: u32,
    pub(super) voxel_m: f64,
    /// Voxels along a cell's side.
    pub(super) cell_voxels: i64,
    pub(super) cell_m: f64,
    /// Lowest and highest index of the voxels that reach into the band, from the first voxel above the floor where
    /// there is one.
    band: [i32; 2],
    floor: Option<&'a Floor>,
}

impl<'a> Projection<'a> {
    pub(super) fn of(
        lattice: &Lattice,
        request: &GridRequest,
        floor: Option<&'a Floor>,
    ) -> Result<Self, GridError> {
        let GridRequest { level, area, band_m, cell_m, .. } = *request;
        if let GridArea::Rectangle { min_m, max_m } = area {
            let is_ordered = (0..2).all(|axis| min_m[axis] <= max_m[axis]);
            if !is_ordered || !min_m.iter().chain(&max_m).all(|c| c.is_finite()) {
                return Err(GridError::Rectangle(min_m, max_m));
            }
            check_range("min_m", min_m, lattice)?;
            check_range("max_m", max_m, lattice)?;
        }
        let is_in_order = band_m[0] <= band_m[1];
        if !is_in_order {
            return Err(GridError::Band(band_m));
        }
        let (min_m, end_m) = lattice.range_m();
        if band_m[1] < min_m || band_m[0] >= end_m {
            return Err(GridError::BandRange { band_m, min_m, end_m });
        }
        let voxel_m = lattice.resolution_m(level);
        let cell_voxels =
            whole(cell_m / voxel_m).filter(|voxels| (1.0..=f64::from(INDEX_MAX)).contains(voxels));
        let cell_voxels = cell_voxels.ok_or(GridError::Cell { cell_m, voxel_m })?;
        let band = band_of(voxel_m, band_m);
        Ok(Self {
            level,
            voxel_m,
            cell_voxels: cell_voxels as i64,
            cell_m: cell_voxels * voxel_m,
            band,
            floor,
        })
    }

    /// The smallest rectangle with all cells that have a voxel in the band.
    pub(super) fn occupied_cells(&self, view: &mut PausingView<'_>, stop: StopSignal<'_>) -> Cells {
        let [low_m, high_m] = self.heights_m();
        let everywhere = Region::Box {
            min_m: [f64::NEG_INFINITY, f64::NEG_INFINITY, low_m],
            max_m: [f64::INFINITY, f64::INFINITY, high_m],
        };
        let mut cells: Option<Cells> = None;
        self.for_each_voxel(view, &everywhere, stop, |cell, z, base| {
            if !self.is_in_band(z, base.height) {
                return;
            }
            let cells = cells.get_or_insert(Cells { first: cell, end: cell });
            for (axis, at) in cell.into_iter().enumerate() {
                cells.first[axis] = cells.first[axis].min(at);
                cells.end[axis] = cells.end[axis].max(at + 1);
            }
        });
        cells.unwrap_or(Cells::NONE)
    }

    pub(super) fn grid(&self, view: &mut PausingView<'_>, cells: &Cells, stop: StopSignal<'_>) -> Grid {
        let size = [0, 1].map(|axis| cells.size(axis) as usize);
        let count = size[0] * size[1];
        let (mut occupied, mut tops_m) = (vec![0u64; count.div_ceil(64)], vec![f32::NAN; count]);
        let mut floor: Option<[i32; 2]> = None;
        self.for_each_voxel(view, &cells.region(self.cell_m, self.heights_m()), stop, |cell, z, base| {
            let Some(number) = cells.number(cell) else { return };
            if let Some(height) = base.floor {
                let [low, high] = floor.get_or_insert([height; 2]);
                (*low, *high) = (height.min(*low), height.max(*high));
            }
            if self.is_in_band(z, base.height) {
                occupied[number / 64] |= 1 << (number % 64);
                // The larger of the two, NaN passed over.
                tops_m[number] = tops_m[number].max(((f64::from(z) + 1.0) * self.voxel_m) as f32);
            }
        });
        Grid {
            cell_m: self.cell_m,
            origin_m: cells.first.map(|c| c as f64 * self.cell_m),
            size,
            occupied,
            tops_m,
            free: None,
            floor_m: floor.map(|range| range.map(|height| f64::from(height) * self.voxel_m)),
        }
    }

    /// Where the voxels of the band begin and end, meters: what holds their centers, however thin the band. Above all
    /// of the floor, and with the voxels that the floor itself lies in.
    fn heights_m(&self) -> [f64; 2] {
        let [first, last] = self.band.map(f64::from);
        let [low, high] = self.base_range().map(f64::from);
        let floor = if self.floor.is_some() { first.min(-1.0) } else { first };
        [(low + floor) * self.voxel_m, (high + last + 1.0) * self.voxel_m]
    }

    /// The lowest and the highest index of voxels of the band, above any of the floor.
    pub(super) fn heights(&self) -> [i64; 2] {
        let range = self.base_range();
        [0, 1].map(|end| i64::from(self.band[end]) + i64::from(range[end]))
    }

    /// The lowest and the highest height that the band counts from.
    pub(super) fn base_range(&self) -> [i32; 2] {
        self.floor.map_or([0; 2], Floor::range)
    }

    /// What the band counts from in a column.
    pub(super) fn base(&self, column: [i32; 2]) -> Base {
        match self.floor {
            Some(floor) => match floor.within(column) {
                Some(Height { floor, base }) => Base { height: base, floor: Some(floor) },
                None => Base { height: floor.near(column), floor: None },
            },
            None => Base { height: 0, floor: None },
        }
    }

    /// True of a voxel whose index is `z` in a column where the band counts from `base`.
    pub(super) fn is_in_band(&self, z: i32, base: i32) -> bool {
        let above = i64::from(z) - i64::from(base);
        (i64::from(self.band[0])..=i64::from(self.band[1])).contains(&above)
    }

    /// Calls `f` with the cell and the height's index of each voxel in the blocks that meet `region`, and what the band
    /// counts from in its column. Others go first between the shards.
    fn for_each_voxel(
        &self,
        view: &mut PausingView<'_>,
        region: &Region,
        stop: StopSignal<'_>,
        mut f: impl FnMut([i64; 2], i32, Base),
    ) {
        let selection = VoxelSelection::from(Some(*region));
        // Blocks above each other and voxels of a block have columns in common.
        let mut bases = [([i32::MIN; 2], Base { height: 0, floor: None }); COLUMNS];
        for shard in 0..SHARDS {
            view.give_way(stop);
            let view = view.view();
            let Some(list) = view.lists(self.level).nth(shard) else { continue };
            let up = list.levels_up();
            view.for_each_block(&list, &selection, stop, |block: VoxelKey, mask: &BlockMask| {
                for cell in mask.cells(up) {
                    let [x, y, z] = cell.voxel(block).ancestor(up).index();
                    let [place_x, place_y] = [x, y].map(|i| i.rem_euclid(BLOCK_SIDE) as usize);
                    let known = &mut bases[place_y * BLOCK_SIDE as usize + place_x];
                    if known.0 != [x, y] {
                        *known = ([x, y], self.base([x, y]));
                    }
                    f([x, y].map(|i| i64::from(i).div_euclid(self.cell_voxels)), z, known.1);
                }
            });
        }
    }
}

/// What the band counts from in a column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Base {
    /// The index of the voxel that begins there.
    pub(super) height: i32,
    /// The index of the first voxel above the floor, where it reaches the column.
    floor: Option<i32>,
}

/// The lowest and the highest index of voxels that have more than a border in common with a band, in voxels of side
/// `voxel_m`; of a band without height, or whose ends lie in one voxel, that voxel. Never in the wrong order.
fn band_of(voxel_m: f64, band_m: [f64; 2]) -> [i32; 2] {
    let [low, high] = band_m.map(|c| (c / voxel_m).clamp(f64::from(INDEX_MIN), f64::from(INDEX_MAX)));
    let first = whole(low).unwrap_or_else(|| low.floor()) as i32;
    let end = whole(high).unwrap_or_else(|| high.ceil()) as i32;
    [first, (end - 1).max(first)]
}

/// Refuses a corner out of the range of a map.
fn check_range(field: &'static str, value: [f64; 2], lattice: &Lattice) -> Result<(), GridError> {
    let (min_m, max_m) = lattice.range_m();
    let is_within = value.iter().all(|c| (min_m..=max_m).contains(c));
    is_within.then_some(()).ok_or(GridError::Range { field, value, min_m, max_m })
}
