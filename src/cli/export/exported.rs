//! What `mrol export` says of a file that it wrote.

use std::fmt;
use std::fmt::Display;
use std::path::Path;

use serde::Serialize;

use super::source::Voxels;
use mrol::console::count;

/// A file that was written.
#[derive(Serialize)]
pub(super) struct Exported {
    out: String,
    points: usize,
    level: u32,
    resolution_m: f64,
    revision: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    origin_m: Option<[f64; 3]>,
}

impl Exported {
    /// A point cloud of the centers of voxels.
    pub(super) fn of(out: &Path, voxels: &Voxels) -> Self {
        Self {
            out: out.display().to_string(),
            points: voxels.keys.len(),
            level: voxels.level,
            resolution_m: voxels.resolution_m,
            revision: voxels.revision,
            origin_m: voxels.origin.map(|origin| origin.position_m),
        }
    }
}

impl Display for Exported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { out, points, resolution_m, revision, .. } = self;
        let points = count(*points);
        write!(
            f,
            "{out}: {points} points, the centers of voxels of {resolution_m} m, at revision {revision}"
        )?;
        if let Some([x, y, z]) = self.origin_m {
            write!(f, "; add {x} {y} {z} for the coordinates of the survey")?;
        }
        Ok(())
    }
}
