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
    #[serde(flatten)]
    content: Content,
    level: u32,
    resolution_m: f64,
    revision: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    origin_m: Option<[f64; 3]>,
}

/// What is in the file.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum Content {
    /// The centers of voxels in the map frame.
    Centers { points: usize },
    /// The centers of voxels in the coordinates of the survey.
    Survey { points: usize },
    /// Arrays of voxels.
    Arrays { voxels: usize },
    /// Messages.
    Recording {
        points: usize,
        /// Cells of the grid; none where none could be drawn.
        #[serde(skip_serializing_if = "Option::is_none")]
        grid_cells: Option<usize>,
        robots: usize,
        poses: usize,
    },
    /// A tree of cells.
    Octree(OctreeCells),
}

/// Cells of a tree.
#[derive(Serialize)]
pub(super) struct OctreeCells {
    /// Occupied ones.
    pub(super) occupied: u64,
    /// Free ones.
    pub(super) free: u64,
    /// Leaves that all of them were joined to.
    pub(super) leaves: usize,
    /// True of a tree of probabilities, which nobody measured.
    #[serde(skip)]
    pub(super) has_probabilities: bool,
}

impl Exported {
    /// A file of voxels.
    pub(super) fn of(out: &Path, content: Content, voxels: &Voxels) -> Self {
        Self {
            out: out.display().to_string(),
            content,
            level: voxels.level,
            resolution_m: voxels.resolution_m,
            revision: voxels.revision,
            origin_m: voxels.origin.map(|origin| origin.position_m),
        }
    }
}

impl Display for Exported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { out, content, resolution_m, revision, .. } = self;
        match content {
            Content::Centers { points } | Content::Survey { points } => {
                let points = count(*points);
                write!(
                    f,
                    "{out}: {points} points, the centers of voxels of {resolution_m} m, at revision {revision}"
                )?;
            }
            Content::Arrays { voxels } => {
                let voxels = count(*voxels);
                write!(f, "{out}: {voxels} voxels of {resolution_m} m as arrays, at revision {revision}")?;
            }
            Content::Recording { points, grid_cells, robots, poses } => {
                let (points, poses) = (count(*points), count(*poses));
                let grid = grid_cells
                    .map_or("no grid".to_owned(), |cells| format!("a grid of {} cells", count(cells)));
                write!(
                    f,
                    "{out}: {points} voxels of {resolution_m} m, {grid}, {poses} poses of {robots} robots, at revision \
                     {revision}"
                )?;
            }
            Content::Octree(OctreeCells { occupied, free, leaves, has_probabilities }) => {
                let (occupied, free) = (count(*occupied as usize), count(*free as usize));
                let leaves = count(*leaves);
                write!(
                    f,
                    "{out}: {occupied} occupied and {free} free cells of {resolution_m} m in {leaves} leaves, at \
                     revision {revision}"
                )?;
                if *has_probabilities {
                    write!(f, "; probabilities are OctoMap's limits for occupied and free, not measured")?;
                }
            }
        }
        match (content, self.origin_m) {
            (Content::Survey { .. }, Some([x, y, z])) => {
                write!(f, "; the origin {x} {y} {z} is added to them")
            }
            (Content::Centers { .. } | Content::Octree(_) | Content::Recording { .. }, Some([x, y, z])) => {
                write!(f, "; add {x} {y} {z} for the coordinates of the survey")
            }
            _ => Ok(()),
        }
    }
}
