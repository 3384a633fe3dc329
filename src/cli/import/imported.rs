//! A map that was made of a file, and what `mrol import` says of it.

use std::fmt;
use std::fmt::Display;
use std::path::Path;

use serde::Serialize;

use mrol::console::{CliError, count};
use mrol_map::map::{MapContents, MapSettings};

/// A map that was made of a file.
pub(super) struct Imported {
    pub(super) settings: MapSettings,
    pub(super) contents: MapContents,
}

/// What was written.
#[derive(Serialize)]
pub(super) struct ImportedLine {
    out: String,
    voxels: usize,
    resolution_m: f64,
    levels: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    origin_m: Option<[f64; 3]>,
    revision: u64,
}

impl ImportedLine {
    /// A map that is written to `out`.
    pub(super) fn of(out: &Path, Imported { settings, contents }: &Imported) -> Self {
        Self {
            out: out.display().to_string(),
            voxels: contents.voxels.len(),
            resolution_m: settings.resolution_m,
            levels: settings.levels,
            origin_m: settings.origin.map(|origin| origin.position_m),
            revision: contents.revision,
        }
    }
}

impl Display for ImportedLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { out, voxels, resolution_m, levels, .. } = self;
        let voxels = count(*voxels);
        write!(f, "{out}: a map of {voxels} voxels of {resolution_m} m, {levels} levels")?;
        if let Some([x, y, z]) = self.origin_m {
            write!(f, ", its origin at {x} {y} {z} of the survey")?;
        }
        Ok(())
    }
}

/// The error of a file, which names it.
pub(super) fn in_file<E: Display>(path: &Path) -> impl FnOnce(E) -> CliError {
    let path = path.display().to_string();
    move |problem| CliError::failed(format!("{path}: {problem}"))
}
