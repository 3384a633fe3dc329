//! Maps of octrees of OctoMap.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use super::imported::{Imported, in_file};
use super::options::ImportOptions;
use mrol::console::{CliError, Output, count};
use mrol_files::octree::{OctreeReader, OctreeVoxels};
use mrol_files::open_regular;
use mrol_map::map::MapContents;

/// Bytes that are read at once.
const BYTES_AT_ONCE: usize = 1 << 20;

/// The map of the occupied leaves of a tree.
///
/// # Errors
/// When the file is no tree to its end, or the options do not fit it.
pub(super) fn read(import: &ImportOptions, output: &Output) -> Result<Imported, CliError> {
    let path = import.file.as_path();
    import.refuse_options_of_points()?;
    let (file, bytes) = open(path)?;
    let mut reader =
        OctreeReader::new(BufReader::with_capacity(BYTES_AT_ONCE, file)).map_err(in_file(path))?;
    let (resolution_m, coarser) = import.resolution_of_voxels(reader.resolution_m())?;
    let settings = import.settings(resolution_m, None)?;
    let bar = output.clone().with_bar_of_bytes(bytes);
    let read = OctreeVoxels::read(&mut reader, coarser, |position| bar.advance_to(position));
    bar.clear_bar();
    let OctreeVoxels { voxels, occupied, free } = read.map_err(in_file(path))?;
    let (occupied, free) = (count(occupied as usize), count(free as usize));
    output.note(format!(
        "{occupied} occupied leaves became voxels; {free} free ones and all probabilities are left out: a map knows \
         free space by what its scans saw through"
    ));
    Ok(Imported { settings, contents: MapContents::at(1, voxels) })
}

/// Opens a file, with its length.
pub(super) fn open(path: &Path) -> Result<(File, u64), CliError> {
    open_regular(path).map_err(in_file(path))
}
