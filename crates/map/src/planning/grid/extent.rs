//! How large a grid will be, before it is drawn.

use super::project::cells_of;
use super::projection::Projection;
use super::request::{GridError, GridRequest};
use crate::map::PausingView;
use crate::util::StopSignal;

/// The cells of a grid. Cell (i, j) spans [i, i + 1) * `cell_m` in x and [j, j + 1) * `cell_m` in y of the map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
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
}

/// Which cells the grid has that [`project_grid`](super::project_grid) would draw: as long as the area is given,
/// without looking at a voxel.
///
/// # Errors
/// When a number is out of range, or there are more cells than may be.
pub fn grid_extent(
    view: &mut PausingView<'_>,
    request: &GridRequest,
    stop: StopSignal<'_>,
) -> Result<GridExtent, GridError> {
    let projection = Projection::of(view.lattice(), request)?;
    let cells = cells_of(&projection, view, request, stop)?;
    Ok(GridExtent {
        cell_m: projection.cell_m,
        cell_voxels: projection.cell_voxels,
        first: cells.first,
        size: [0, 1].map(|axis| cells.size(axis) as usize),
    })
}
