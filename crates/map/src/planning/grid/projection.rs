//! The voxels of a band of height, projected on cells.

use super::cells::{Cells, whole};
use super::occupancy_grid::Grid;
use super::request::{GridArea, GridError, GridRequest};
use crate::map::{PausingView, Region, SHARDS, VoxelSelection};
use crate::util::StopSignal;
use crate::voxel::{BlockMask, INDEX_MAX, INDEX_MIN, Lattice, VoxelKey};

/// A request that was checked.
pub(super) struct Projection {
    pub(super) level: u32,
    pub(super) voxel_m: f64,
    /// Voxels along a cell's side.
    pub(super) cell_voxels: i64,
    pub(super) cell_m: f64,
    /// Lowest and highest index of the voxels that reach into the band.
    pub(super) band: [i32; 2],
}

impl Projection {
    pub(super) fn of(lattice: &Lattice, request: &GridRequest) -> Result<Self, GridError> {
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
        Ok(Self { level, voxel_m, cell_voxels: cell_voxels as i64, cell_m: cell_voxels * voxel_m, band })
    }

    /// The smallest rectangle with all cells that have a voxel in the band.
    pub(super) fn occupied_cells(&self, view: &mut PausingView<'_>, stop: StopSignal<'_>) -> Cells {
        let [low_m, high_m] = self.heights_m();
        let everywhere = Region::Box {
            min_m: [f64::NEG_INFINITY, f64::NEG_INFINITY, low_m],
            max_m: [f64::INFINITY, f64::INFINITY, high_m],
        };
        let mut cells: Option<Cells> = None;
        self.for_each_voxel(view, &everywhere, stop, |cell, _| {
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
        self.for_each_voxel(view, &cells.region(self.cell_m, self.heights_m()), stop, |cell, z| {
            if let Some(number) = cells.number(cell) {
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
        }
    }

    /// Where the voxels of the band begin and end, meters: what holds their centers, however thin the band.
    fn heights_m(&self) -> [f64; 2] {
        let [first, last] = self.band.map(f64::from);
        [first * self.voxel_m, (last + 1.0) * self.voxel_m]
    }

    /// Calls `f` with the cell and the height's index of each voxel of the band in the blocks that meet `region`.
    /// Others go first between the shards.
    fn for_each_voxel(
        &self,
        view: &mut PausingView<'_>,
        region: &Region,
        stop: StopSignal<'_>,
        mut f: impl FnMut([i64; 2], i32),
    ) {
        let selection = VoxelSelection::from(Some(*region));
        for shard in 0..SHARDS {
            view.give_way(stop);
            let view = view.view();
            let Some(list) = view.lists(self.level).nth(shard) else { continue };
            let up = list.levels_up();
            view.for_each_block(&list, &selection, stop, |block: VoxelKey, mask: &BlockMask| {
                for cell in mask.cells(up) {
                    let [x, y, z] = cell.voxel(block).ancestor(up).index();
                    if (self.band[0]..=self.band[1]).contains(&z) {
                        f([x, y].map(|i| i64::from(i).div_euclid(self.cell_voxels)), z);
                    }
                }
            });
        }
    }
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
