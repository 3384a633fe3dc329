//! The centers of voxels as a point cloud: .ply and .pcd.

use std::path::Path;

use nalgebra::Point3;

use super::exported::Content;
use super::source::Voxels;
use mrol::console::CliError;
use mrol_files::FileKind;
use mrol_map::geometry::Point;
use mrol_map::scan::{write_pcd, write_ply};

/// Writes a point for each voxel, in the map frame.
///
/// # Errors
/// When the file cannot be written.
pub(super) fn write(kind: FileKind, out: &Path, voxels: &Voxels) -> Result<Content, CliError> {
    let points: Vec<Point> = voxels.centers_m().map(|center_m| Point::from(Point3::from(center_m))).collect();
    let written = match kind {
        FileKind::Pcd => write_pcd(out, &points),
        _ => write_ply(out, &points),
    };
    written.map_err(CliError::writing(out))?;
    Ok(Content::Centers { points: points.len() })
}
