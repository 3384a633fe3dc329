//! Maps of arrays of numpy.

use std::io::BufReader;

use nalgebra::Point3;

use super::cloud::PointMap;
use super::imported::{Imported, in_file};
use super::octree::open;
use super::options::ImportOptions;
use mrol::console::{CliError, Output};
use mrol_files::npz::{NpzContent, NpzReader};
use mrol_map::map::{MapContents, MapOrigin};

/// The map of the indices of voxels, or of points where there are none.
///
/// # Errors
/// When the file has neither, is cut off, or the options do not fit it.
pub(super) fn read(import: &ImportOptions, output: &Output) -> Result<Imported, CliError> {
    let path = import.file.as_path();
    let (file, _) = open(path)?;
    let mut reader = NpzReader::new(BufReader::new(file)).map_err(in_file(path))?;
    let bar = output.clone().with_bar_of_bytes(reader.bytes());
    let imported = match reader.content {
        NpzContent::Voxels { resolution_m } => {
            import.refuse_options_of_points()?;
            let (resolution_m, coarser) = import.resolution_of_voxels(resolution_m)?;
            let origin = MapOrigin::new(reader.origin_m).map_err(in_file(path))?;
            let origin = Some(origin).filter(|origin| origin.position_m != [0.0; 3]);
            let settings = import.settings(resolution_m, origin)?;
            let voxels = reader.read_voxels(coarser, |read| bar.advance_to(read));
            Imported { settings, contents: MapContents::at(1, voxels.map_err(in_file(path))?) }
        }
        NpzContent::Points => {
            let mut map = PointMap::new(import, output)?;
            let mut refused = Ok(());
            let read = reader.read_points(|part, read| {
                if refused.is_ok() {
                    let points: Vec<Point3<f64>> = part.iter().map(|&point| Point3::from(point)).collect();
                    refused = map.add(&points);
                }
                bar.advance_to(read);
            });
            read.map_err(in_file(path))?;
            refused?;
            map.finish()
        }
    };
    bar.clear_bar();
    Ok(imported)
}
