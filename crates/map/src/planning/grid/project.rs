//! Drawing a grid: voxels, keep-outs, and what is free.

use super::cells::Cells;
use super::floor::{Floor, find_floor};
use super::occupancy_grid::Grid;
use super::projection::Projection;
use super::request::{GridArea, GridError, GridRequest};
use crate::map::PausingView;
use crate::planning::keep_outs::Shapes;
use crate::util::StopSignal;

/// Which cells of a grid have occupied voxels of a level in a band of height, and how high these reach.
///
/// Cells are whole numbers of voxels and begin at whole multiples of their side from the map's origin, so that each
/// voxel lies in one cell. Voxels of the band are those that reach into it: that have more than a border in common with
/// it, however little, and of a band that is thinner than a voxel those that hold it. So no obstacle is passed over
/// because the center of its voxel lies above or below.
///
/// Heights count from z = 0 of the map, or in each column of voxels from the floor there ([`find_floor`]). Then what is
/// lower than two voxels of the level may be taken for floor. What lies below the floor, as the bottom of a pit or of
/// stairs that lead down, is in no such band that begins above it, and is not drawn.
///
/// Where the view has keep-outs ([`MapView::with_keep_outs`]), a cell that has a point of one in the band is occupied
/// too; they have no top, and make no grid larger that is as large as what is there.
///
/// Where that is asked for, a cell is free that is not occupied and in which each column of voxels has a free one in
/// the band: one that a scan saw through, where the view has viewpoints ([`MapView::with_viewpoints`]). Whoever drives
/// there drove or looked through the column at some height; what is above or below of it may be unknown. Cells that are
/// neither are unknown.
///
/// Walks the blocks that the area and the band meet, or all that are stored where those are fewer. Takes 8 bytes a
/// cell, and 4 more where cells are told apart. Others go first between its parts, so that parts of the grid may be of
/// later revisions than [`PausingView::version`]. Once stopped, the grid lacks voxels.
///
/// # Errors
/// When a number is out of range, there are more cells than may be, or no floor is found where the band counts from it.
///
/// [`MapView::with_keep_outs`]: crate::map::MapView::with_keep_outs
/// [`MapView::with_viewpoints`]: crate::map::MapView::with_viewpoints
pub fn project_grid(
    view: &mut PausingView<'_>,
    request: &GridRequest,
    stop: StopSignal<'_>,
) -> Result<Grid, GridError> {
    // What cannot be drawn is refused before the floor is looked for.
    Projection::of(view.lattice(), request, None)?;
    let floor = find_floor(view, request, stop)?;
    project_grid_above(view, request, floor.as_deref(), stop)
}

/// [`project_grid`] with a band that counts from `floor`, as [`find_floor`] found it for a request of the same level
/// and band; without one, from z = 0 of the map.
///
/// # Errors
/// As [`project_grid`] has them.
pub fn project_grid_above(
    view: &mut PausingView<'_>,
    request: &GridRequest,
    floor: Option<&Floor>,
    stop: StopSignal<'_>,
) -> Result<Grid, GridError> {
    let projection = Projection::of(view.lattice(), request, floor)?;
    let cells = cells_of(&projection, view, request, stop)?;
    let mut grid = projection.grid(view, &cells, stop);
    if let Some(shapes) = Shapes::of(view.view()) {
        projection.mark_keep_outs(&shapes, &cells, &mut grid, request.band_m, stop);
    }
    if request.tells_unknown {
        grid.free = Some(projection.free_cells(view, &cells, &grid, stop));
    }
    Ok(grid)
}

/// The cells of the grid that is asked for.
pub(super) fn cells_of(
    projection: &Projection<'_>,
    view: &mut PausingView<'_>,
    request: &GridRequest,
    stop: StopSignal<'_>,
) -> Result<Cells, GridError> {
    let cells = match request.area {
        GridArea::Rectangle { min_m, max_m } => Cells::of_rectangle(min_m, max_m, projection.cell_m),
        GridArea::Occupied => projection.occupied_cells(view, stop),
    };
    let count = cells.size(0) as f64 * cells.size(1) as f64;
    if count > request.cells_max as f64 {
        return Err(GridError::Cells { cells: count, cell_m: projection.cell_m, most: request.cells_max });
    }
    Ok(cells)
}
