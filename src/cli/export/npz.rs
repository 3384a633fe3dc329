//! Voxels as arrays of numpy.

use std::fs::File;
use std::io::BufWriter;

use super::exported::Content;
use super::source::Voxels;
use mrol::console::{CliError, NewFile, Output};
use mrol_files::npz::VoxelArrays;

/// Writes the centers and the indices of voxels.
///
/// # Errors
/// When the file cannot be written.
pub(super) fn write(out: &NewFile, voxels: &Voxels, output: &Output) -> Result<Content, CliError> {
    let Voxels { level, resolution_m, revision, origin, keys, .. } = voxels;
    let arrays = VoxelArrays {
        keys,
        resolution_m: *resolution_m,
        origin: *origin,
        level: *level,
        revision: *revision,
    };
    let output = output.clone().with_bar_of(2 * keys.len(), "rows");
    let file = File::create(out.path()).map_err(|problem| out.failed(problem))?;
    let written = arrays.write(BufWriter::new(file), |rows| output.advance_to(rows as u64));
    output.clear_bar();
    written.map_err(|problem| out.failed(problem))?;
    Ok(Content::Arrays { voxels: keys.len() })
}
