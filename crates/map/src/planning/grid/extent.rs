//! How large a grid will be, before it is drawn.

use std::sync::Arc;

use super::floor::{Floor, find_floor};
use super::project::cells_of;
use super::projection::Projection;
use super::request::{GridError, GridRequest};
use crate::map::PausingView;
use crate::util::StopSignal;

/// The cells of a grid. Cell (i, j) spans [i, i + 1) * `cell_m` in x and [j, j + 1) * `cell_m` in y of the map frame.
#[derive(Debug, Clone, PartialEq)]
pub struct GridExtent {
    /// Side of a cell, meters.
    pub cell_m: f64,
    /// Voxels of the level along a cell's side.
    pub cell_voxels: i64,
    /// The first cell along x and y.
    pub first: [i64; 2],
    /// Number of cells along x and y; none where an area was asked for that is as large as what is there, and nothing
    /// is.
    pub size: [usize; 2],
    /// The floor that the band counts from, where it counts from the floor: as it is in the first revision.
    pub floor: Option<Arc<Floor>>,
}

/// Which cells the grid has that [`project_grid`](super::project_grid) would draw: as long as the area is given,
/// without looking at a voxel, but for the floor.
///
/// # Errors
/// When a number is out of range, there are more cells than may be, or no floor is found where the band counts from it.
pub fn grid_extent(
    view: &mut PausingView<'_>,
    request: &GridRequest,
    stop: StopSignal<'_>,
) -> Result<GridExtent, GridError> {
    Projection::of(view.lattice(), request, None)?;
    let floor = find_floor(view, request, stop)?;
    let projection = Projection::of(view.lattice(), request, floor.as_deref())?;
    let cells = cells_of(&projection, view, request, stop)?;
    Ok(GridExtent {
        cell_m: projection.cell_m,
        cell_voxels: projection.cell_voxels,
        first: cells.first,
        size: [0, 1].map(|axis| cells.size(axis) as usize),
        floor,
    })
}
