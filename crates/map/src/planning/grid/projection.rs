//! The voxels of a band of height, projected on cells.

use super::cells::{Cells, whole};
use super::occupancy_grid::Grid;
use super::request::{GridArea, GridError, GridRequest};
use crate::map::{MapView, Region, VoxelSelection};
use crate::util::StopSignal;
use crate::voxel::{BlockMask, INDEX_MAX, INDEX_MIN, Lattice, VoxelKey};

/// A request that was checked, with the view that answers it.
pub(super) struct Projection<'a> {
    pub(super) view: &'a MapView<'a>,
    pub(super) level: u32,
    pub(super) voxel_m: f64,
    /// Voxels along a cell's side.
    pub(super) cell_voxels: i64,
    pub(super) cell_m: f64,
    band_m: [f64; 2],
    /// Lowest and highest index of voxels in the band.
    pub(super) band: [i32; 2],
}

impl<'a> Projection<'a> {
    pub(super) fn of(view: &'a MapView<'a>, request: &GridRequest) -> Result<Self, GridError> {
        let GridRequest { level, area, band_m, cell_m, .. } = *request;
        if let GridArea::Rectangle { min_m, max_m } = area {
            let is_ordered = (0..2).all(|axis| min_m[axis] <= max_m[axis]);
            if !is_ordered || !min_m.iter().chain(&max_m).all(|c| c.is_finite()) {
                return Err(GridError::Rectangle(min_m, max_m));
            }
            check_range("min_m", min_m, view.lattice())?;
            check_range("max_m", max_m, view.lattice())?;
        }
        let is_in_order = band_m[0] <= band_m[1];
        if !is_in_order {
            return Err(GridError::Band(band_m));
        }
        let voxel_m = view.lattice().resolution_m(level);
        let cell_voxels =
            whole(cell_m / voxel_m).filter(|voxels| (1.0..=f64::from(INDEX_MAX)).contains(voxels));
        let cell_voxels = cell_voxels.ok_or(GridError::Cell { cell_m, voxel_m })?;
        let band = band_of(view.lattice(), level, band_m);
        Ok(Self {
            view,
            level,
            voxel_m,
            cell_voxels: cell_voxels as i64,
            cell_m: cell_voxels * voxel_m,
            band_m,
            band,
        })
    }

    /// The smallest rectangle with all cells that have a voxel in the band.
    pub(super) fn occupied_cells(&self, stop: StopSignal<'_>) -> Cells {
        let everywhere = Region::Box {
            min_m: [f64::NEG_INFINITY, f64::NEG_INFINITY, self.band_m[0]],
            max_m: [f64::INFINITY, f64::INFINITY, self.band_m[1]],
        };
        let mut cells: Option<Cells> = None;
        self.for_each_voxel(&everywhere, stop, |cell, _| {
            let cells = cells.get_or_insert(Cells { first: cell, end: cell });
            for (axis, at) in cell.into_iter().enumerate() {
                cells.first[axis] = cells.first[axis].min(at);
                cells.end[axis] = cells.end[axis].max(at + 1);
            }
        });
        cells.unwrap_or(Cells::NONE)
    }

    pub(super) fn grid(&self, cells: &Cells, stop: StopSignal<'_>) -> Grid {
        let size = [0, 1].map(|axis| cells.size(axis) as usize);
        let count = size[0] * size[1];
        let (mut occupied, mut tops_m) = (vec![0u64; count.div_ceil(64)], vec![f32::NAN; count]);
        self.for_each_voxel(&cells.region(self.cell_m, self.band_m), stop, |cell, z| {
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

    /// Calls `f` with the cell and the height's index of each voxel of the band in the blocks that meet `region`.
    fn for_each_voxel(&self, region: &Region, stop: StopSignal<'_>, mut f: impl FnMut([i64; 2], i32)) {
        let selection = VoxelSelection::from(Some(*region));
        for list in self.view.lists(self.level) {
            let up = list.levels_up();
            self.view.for_each_block(&list, &selection, stop, |block: VoxelKey, mask: &BlockMask| {
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

/// The lowest and the highest index of voxels of `level` whose centers lie in a band; in the wrong order where there
/// are none.
pub(in crate::planning) fn band_of(lattice: &Lattice, level: u32, [low_m, high_m]: [f64; 2]) -> [i32; 2] {
    let voxel_m = lattice.resolution_m(level);
    // The voxel that holds the border, from which its center is half a voxel away at most.
    let around = |c: f64| (c / voxel_m).floor().clamp(f64::from(INDEX_MIN), f64::from(INDEX_MAX)) as i32;
    let center_m = |i: i32| (f64::from(i) + 0.5) * voxel_m;
    let (low, high) = (around(low_m), around(high_m));
    let first = (low - 1..=low + 1).find(|&i| center_m(i) >= low_m).unwrap_or(low + 1);
    let last = (high - 1..=high + 1).rev().find(|&i| center_m(i) <= high_m).unwrap_or(high - 1);
    [first, last]
}

/// Refuses a corner out of the range of a map.
fn check_range(field: &'static str, value: [f64; 2], lattice: &Lattice) -> Result<(), GridError> {
    let (min_m, max_m) = lattice.range_m();
    let is_within = value.iter().all(|c| (min_m..=max_m).contains(c));
    is_within.then_some(()).ok_or(GridError::Range { field, value, min_m, max_m })
}
