//! The map from above: which cells of a grid in x y have a voxel within a band of height, and how high it reaches.

mod free;
mod keep_outs;
mod map_server;
#[cfg(test)]
mod tests;

use super::keep_outs::Shapes;
use crate::map::{MapView, Region, VoxelSelection};
use crate::util::StopSignal;
use crate::voxel::{BlockMask, INDEX_MAX, INDEX_MIN, Lattice, VoxelKey};

/// How far, as a share of a cell, a number may lie from whole cells or voxels and still count as that.
const WHOLE_WITHIN: f64 = 1e-6;

/// What to draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridRequest {
    /// Level of the voxels.
    pub level: u32,
    /// Which part of the map, seen from above.
    pub area: GridArea,
    /// Lowest and highest height, meters: voxels count whose centers lie between them or on them. Infinite ones are fine.
    pub band_m: [f64; 2],
    /// Side of a cell, meters: a whole number of the level's voxels.
    pub cell_m: f64,
    /// True where cells without a voxel are told apart: free ones and unknown ones. It takes more time.
    pub tells_unknown: bool,
    /// Most cells of the grid.
    pub cells_max: usize,
}

/// Part of a map, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GridArea {
    /// A rectangle, meters; borders of cells lie at whole multiples of a cell's side, and every cell that it meets belongs
    /// to the grid.
    Rectangle {
        /// Smallest x and y.
        min_m: [f64; 2],
        /// Largest x and y.
        max_m: [f64; 2],
    },
    /// As much as has voxels in the band.
    Occupied,
}

/// Why a grid cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GridError {
    /// A rectangle with corners that are not finite or in the wrong order.
    #[error("area.min_m must be finite and not exceed area.max_m in x or y, got {0:?} and {1:?}")]
    Rectangle([f64; 2], [f64; 2]),
    /// A corner that no map of this resolution reaches.
    #[error("area.{field} must lie within {min_m} m and {max_m} m, as the map does, got {value:?}")]
    Range {
        /// The corner.
        field: &'static str,
        /// Its x and y, meters.
        value: [f64; 2],
        /// The smallest coordinate of the map, meters.
        min_m: f64,
        /// The largest.
        max_m: f64,
    },
    /// A band with NaN or in the wrong order.
    #[error("min_z_m must be at most max_z_m, got {} and {}", .0[0], .0[1])]
    Band([f64; 2]),
    /// A cell that is no whole number of voxels.
    #[error("cell_m must be a whole number of voxels of {voxel_m} m, got {cell_m}")]
    Cell {
        /// The cell's side, meters.
        cell_m: f64,
        /// Side of a voxel of the level, meters.
        voxel_m: f64,
    },
    /// Too many cells.
    #[error("a grid may have {most} cells, the area has {cells} of {cell_m} m")]
    Cells {
        /// Number of cells of the area.
        cells: f64,
        /// The cell's side, meters.
        cell_m: f64,
        /// Most cells.
        most: usize,
    },
}

/// The map from above, row by row from the smallest y, each from the smallest x: cell (x, y) has the number
/// y * `size[0]` + x.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Side of a cell, meters.
    pub cell_m: f64,
    /// Corner of the grid: smallest x and y, meters.
    pub origin_m: [f64; 2],
    /// Number of cells along x and y; none where an area was asked for that is as large as what is there, and nothing is.
    pub size: [usize; 2],
    /// Whether cell i has a voxel or a keep-out: bit i % 64 of `occupied[i / 64]`.
    pub occupied: Vec<u64>,
    /// Height of the top of the highest voxel of each cell that lies in the band, meters; NaN for a cell without one.
    pub tops_m: Vec<f32>,
    /// Whether cell i is free, as `occupied`, where that was asked for: a cell is unknown that is neither. Where it was not, the
    /// grid does not tell what was seen.
    pub free: Option<Vec<u64>>,
}

impl Grid {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.tops_m.len()
    }

    /// True when cell `number` has a voxel or a keep-out.
    pub fn is_occupied(&self, number: usize) -> bool {
        self.occupied[number / 64] >> (number % 64) & 1 == 1
    }

    /// True when cell `number` is unknown, where the grid tells that.
    pub fn is_unknown(&self, number: usize) -> bool {
        let is_free = |free: &Vec<u64>| free[number / 64] >> (number % 64) & 1 == 1;
        !self.is_occupied(number) && self.free.as_ref().is_some_and(|free| !is_free(free))
    }
}

/// A rectangle of whole cells, in cells from the map's origin.
#[derive(Debug, Clone, Copy)]
struct Cells {
    first: [i64; 2],
    end: [i64; 2],
}

impl Cells {
    const NONE: Self = Self { first: [0; 2], end: [0; 2] };

    /// Those that a rectangle in meters meets, in more than a border; the one above where it has no extent.
    fn of_rectangle(min_m: [f64; 2], max_m: [f64; 2], cell_m: f64) -> Self {
        let first = min_m.map(|c| whole(c / cell_m).unwrap_or_else(|| (c / cell_m).floor()) as i64);
        let end = max_m.map(|c| whole(c / cell_m).unwrap_or_else(|| (c / cell_m).ceil()) as i64);
        Self { first, end: std::array::from_fn(|axis| end[axis].max(first[axis].saturating_add(1))) }
    }

    fn size(&self, axis: usize) -> i64 {
        self.end[axis].saturating_sub(self.first[axis])
    }

    /// The number of a cell.
    #[inline(always)]
    fn number(&self, cell: [i64; 2]) -> Option<usize> {
        let [x, y] = std::array::from_fn(|axis| cell[axis] - self.first[axis]);
        let is_inside = (0..self.size(0)).contains(&x) && (0..self.size(1)).contains(&y);
        is_inside.then(|| (y * self.size(0) + x) as usize)
    }

    fn region(&self, cell_m: f64, band_m: [f64; 2]) -> Region {
        let [[x, y], [end_x, end_y]] = [self.first, self.end].map(|corner| corner.map(|c| c as f64 * cell_m));
        Region::Box { min_m: [x, y, band_m[0]], max_m: [end_x, end_y, band_m[1]] }
    }
}

/// Refuses a corner out of the range of a map.
fn check_range(field: &'static str, value: [f64; 2], lattice: &Lattice) -> Result<(), GridError> {
    let (min_m, max_m) = lattice.range_m();
    let is_within = value.iter().all(|c| (min_m..=max_m).contains(c));
    is_within.then_some(()).ok_or(GridError::Range { field, value, min_m, max_m })
}

/// The whole number that `number` nearly is.
fn whole(number: f64) -> Option<f64> {
    let whole = number.round();
    ((number - whole).abs() <= WHOLE_WITHIN).then_some(whole)
}

/// Which cells of a grid have occupied voxels of a level in a band of height, and how high these reach.
///
/// Cells are whole numbers of voxels and begin at whole multiples of their side from the map's origin, so that each voxel
/// lies in one cell. Voxels of the band are those whose centers lie in it, as those of a [`Region`] are.
///
/// Where the view has keep-outs ([`MapView::with_keep_outs`]), a cell that has a point of one in the band is occupied too; they
/// have no top, and make no grid larger that is as large as what is there.
///
/// Where that is asked for, a cell is free that is not occupied and in which each column of voxels has a free one in the band: one that
/// a scan saw through, where the view has viewpoints ([`MapView::with_viewpoints`]). Whoever drives there drove or looked through the
/// column at some height; what is above or below of it may be unknown. Cells that are neither are unknown.
///
/// Walks the blocks that the area and the band meet, or all that are stored where those are fewer. Takes 8 bytes a cell, and 4 more where cells are told apart.
/// The view must cover the whole map. Once stopped, the grid lacks voxels.
///
/// # Errors
/// When a number is out of range, or there are more cells than may be.
pub fn project_grid(
    view: &MapView<'_>,
    request: &GridRequest,
    stop: StopSignal<'_>,
) -> Result<Grid, GridError> {
    let projection = Projection::of(view, request)?;
    let cells = match request.area {
        GridArea::Rectangle { min_m, max_m } => Cells::of_rectangle(min_m, max_m, projection.cell_m),
        GridArea::Occupied => projection.occupied_cells(stop),
    };
    let count = cells.size(0) as f64 * cells.size(1) as f64;
    if count > request.cells_max as f64 {
        return Err(GridError::Cells { cells: count, cell_m: projection.cell_m, most: request.cells_max });
    }
    let mut grid = projection.grid(&cells, stop);
    if let Some(shapes) = Shapes::of(view) {
        keep_outs::mark(&shapes, &cells, &mut grid, request.band_m, stop);
    }
    if request.tells_unknown {
        grid.free = Some(projection.free_cells(&cells, &grid, stop));
    }
    Ok(grid)
}

/// A request that was checked, with the view that answers it.
struct Projection<'a> {
    view: &'a MapView<'a>,
    level: u32,
    voxel_m: f64,
    /// Voxels along a cell's side.
    cell_voxels: i64,
    cell_m: f64,
    band_m: [f64; 2],
    /// Lowest and highest index of voxels in the band.
    band: [i32; 2],
}

impl<'a> Projection<'a> {
    fn of(view: &'a MapView<'a>, request: &GridRequest) -> Result<Self, GridError> {
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
    fn occupied_cells(&self, stop: StopSignal<'_>) -> Cells {
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

    fn grid(&self, cells: &Cells, stop: StopSignal<'_>) -> Grid {
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

/// The lowest and the highest index of voxels of `level` whose centers lie in a band; in the wrong order where there are
/// none.
pub(super) fn band_of(lattice: &Lattice, level: u32, [low_m, high_m]: [f64; 2]) -> [i32; 2] {
    let voxel_m = lattice.resolution_m(level);
    // The voxel that holds the border, from which its center is half a voxel away at most.
    let around = |c: f64| (c / voxel_m).floor().clamp(f64::from(INDEX_MIN), f64::from(INDEX_MAX)) as i32;
    let center_m = |i: i32| (f64::from(i) + 0.5) * voxel_m;
    let (low, high) = (around(low_m), around(high_m));
    let first = (low - 1..=low + 1).find(|&i| center_m(i) >= low_m).unwrap_or(low + 1);
    let last = (high - 1..=high + 1).rev().find(|&i| center_m(i) <= high_m).unwrap_or(high - 1);
    [first, last]
}
