//! Maps of LAS and LAZ: points in the coordinates of a survey.

use super::cloud::PointMap;
use super::imported::{Imported, in_file};
use super::options::ImportOptions;
use mrol::console::{CliError, Output};
use mrol_files::survey::LasReader;

/// The map of the points of a file, which is read part by part.
///
/// # Errors
/// When the file cannot be read, or f32 holds its points too coarsely.
pub(super) fn read(import: &ImportOptions, output: &Output) -> Result<Imported, CliError> {
    let file = import.file.as_path();
    let mut reader = LasReader::open(file).map_err(in_file(file))?;
    let output = output.clone().with_bar_of(reader.points() as usize, "points");
    let mut map = PointMap::new(import, &output)?;
    let mut read = 0;
    loop {
        let points = reader.next_points().map_err(in_file(file))?;
        if points.is_empty() {
            break;
        }
        map.add(&points)?;
        read += points.len() as u64;
        output.advance_to(read);
    }
    output.clear_bar();
    Ok(map.finish())
}
