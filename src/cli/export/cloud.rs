//! The centers of voxels as a point cloud: .ply and .pcd.

use nalgebra::Point3;

use super::exported::Content;
use super::source::Voxels;
use mrol::console::{CliError, NewFile};
use mrol_files::FileKind;
use mrol_map::geometry::Point;
use mrol_map::scan::{write_pcd, write_ply};

/// Writes a point for each voxel, in the map frame.
///
/// # Errors
/// When the file cannot be written.
pub(super) fn write(kind: FileKind, out: &NewFile, voxels: &Voxels) -> Result<Content, CliError> {
    let points: Vec<Point> = voxels.centers_m().map(|center_m| Point::from(Point3::from(center_m))).collect();
    let written = match kind {
        FileKind::Pcd => write_pcd(out.path(), &points),
        _ => write_ply(out.path(), &points),
    };
    written.map_err(|problem| out.failed(problem))?;
    Ok(Content::Centers { points: points.len() })
}
