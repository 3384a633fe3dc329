//! The map of a file from above.

use crate::console::CliError;
use mrol_map::map::PausingView;
use mrol_map::planning::{Grid, GridRequest, project_grid};
use mrol_map::util::StopSignal;
use mrol_service::{GridQuestion, GridScope};
use mrol_store::Snapshot;

/// Most cells of a grid: each takes 12 bytes while it is drawn. A server has a limit of its own.
const CELLS_MAX: usize = 40_000_000;

/// Draws the map of a file from above, as a server draws its maps.
///
/// # Errors
/// When the map has no such level, a number is out of range, or no floor is found where heights count from it.
pub fn grid_of(snapshot: Snapshot, question: &GridQuestion) -> Result<Grid, CliError> {
    let map = snapshot.restore().map_err(CliError::failed)?;
    let levels = map.settings().levels;
    let level = question.asked.level;
    if level >= levels {
        return Err(CliError::usage(format!("--level must be 0 to {}, got {level}", levels - 1)));
    }
    let GridScope { area, band_m, band_from, cell_m, tells_unknown } = question.scope;
    let cell_m = cell_m.unwrap_or_else(|| map.lattice().resolution_m(level));
    let request = GridRequest { level, area, band_m, band_from, cell_m, tells_unknown, cells_max: CELLS_MAX };
    let mut view = PausingView::during(map.long_read(), !question.asked.ignore_keep_outs, true);
    project_grid(&mut view, &request, StopSignal::NEVER).map_err(CliError::failed)
}
