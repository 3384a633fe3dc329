//! The centers of voxels as a survey: .las, .laz and .e57, in its coordinates.

use uuid::Uuid;

use super::exported::Content;
use super::source::Voxels;
use mrol::console::{CliError, NewFile, Output};
use mrol_files::FileKind;
use mrol_files::survey::{LasKind, write_e57, write_las};

/// Writes a point for each voxel, the map's origin added in double precision.
///
/// # Errors
/// When the file cannot be written, or cannot hold the voxels.
pub(super) fn write(
    kind: FileKind,
    out: &NewFile,
    voxels: &Voxels,
    output: &Output,
) -> Result<Content, CliError> {
    let origin_m = voxels.origin.map(|origin| origin.position_m).unwrap_or_default();
    let output = output.clone().with_bar_of(voxels.keys.len(), "points");
    let mut written = 0;
    let centers = voxels.centers_m().inspect(|_| {
        written += 1;
        output.advance_to(written);
    });
    let result = match kind {
        FileKind::E57 => {
            let guid = format!("{{{}}}", Uuid::new_v4());
            write_e57(
                out.path(),
                &guid,
                centers.map(|[x, y, z]| [x + origin_m[0], y + origin_m[1], z + origin_m[2]]),
            )
        }
        _ => {
            let las = if kind == FileKind::Laz { LasKind::Laz } else { LasKind::Las };
            let extent_m = voxels.centers_m().flatten().fold(0.0, |extent: f64, c| extent.max(c.abs()));
            write_las(out.path(), las, origin_m, extent_m, centers)
        }
    };
    output.clear_bar();
    result.map_err(|problem| out.failed(problem))?;
    Ok(Content::Survey { points: voxels.keys.len() })
}
