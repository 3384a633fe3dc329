//! The lines before a tree.

use std::io::{BufRead, Read, Write};

use mrol_map::util::excerpt;
use mrol_map::voxel::{RESOLUTION_MAX_M, RESOLUTION_MIN_M};

use super::error::OctreeError;
use crate::counted::Counted;

/// First line of a `.bt` file.
const BINARY: &str = "# Octomap OcTree binary file";
/// First line of an `.ot` file.
const FULL: &str = "# Octomap OcTree file";
/// Bytes of a line, at most.
const LINE_BYTES_MAX: u64 = 1024;
/// Lines, at most.
const LINES_MAX: usize = 1000;

/// What a node of a file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NodeFormat {
    /// Of `.bt`: the states of its children.
    States,
    /// Of `.ot`: log-odds, as many bytes of something else, and which children it has.
    LogOdds {
        /// Bytes of a color.
        ignored_bytes: usize,
    },
}

/// What the lines say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Header {
    pub(super) format: NodeFormat,
    /// Nodes of the tree, as the file says.
    pub(super) nodes: u64,
    /// Side of a finest cell, meters.
    pub(super) resolution_m: f64,
}

impl Header {
    /// Reads the lines up to the tree.
    pub(super) fn read(file: &mut Counted<impl BufRead>) -> Result<Self, OctreeError> {
        let first = line(file)?;
        // The other first line begins otherwise.
        let is_full = match first.trim_end() {
            text if text.starts_with(BINARY) => false,
            text if text.starts_with(FULL) => true,
            other => return Err(OctreeError::NoOctree(excerpt(other))),
        };
        let (mut id, mut nodes, mut resolution_m) = (None, None, None);
        for number in 2..LINES_MAX {
            let line = line(file)?;
            let problem = |problem: &str| OctreeError::Header { line: number, problem: problem.to_owned() };
            let (keyword, value) = line.trim().split_once(' ').unwrap_or((line.trim(), ""));
            let value = value.trim();
            match keyword {
                "data" => {
                    let resolution_m = resolution_m.ok_or(OctreeError::Lacking("res"))?;
                    let nodes = nodes.ok_or(OctreeError::Lacking("size"))?;
                    let id: String = id.ok_or(OctreeError::Lacking("id"))?;
                    return Ok(Self { format: NodeFormat::of(is_full, &id)?, nodes, resolution_m });
                }
                "id" => id = Some(value.to_owned()),
                "size" => {
                    let count =
                        value.parse().map_err(|_| problem(&not_a("number of nodes", "size", value)))?;
                    nodes = Some(count);
                }
                "res" => {
                    let side_m: f64 =
                        value.parse().map_err(|_| problem(&not_a("number of meters", "res", value)))?;
                    if !(RESOLUTION_MIN_M..=RESOLUTION_MAX_M).contains(&side_m) {
                        return Err(OctreeError::Resolution(side_m));
                    }
                    resolution_m = Some(side_m);
                }
                // OctoMap passes words over that it does not know. A file that ended has empty lines alone.
                _ if line.is_empty() => return Err(OctreeError::Lacking("data")),
                _ => {}
            }
        }
        Err(OctreeError::Lacking("data"))
    }

    /// Writes the lines up to the tree.
    pub(super) fn write(&self, file: &mut impl Write) -> std::io::Result<()> {
        let first = if self.format == NodeFormat::States { BINARY } else { FULL };
        let Self { nodes, resolution_m, .. } = self;
        write!(
            file,
            "{first}\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n\
             id OcTree\nsize {nodes}\nres {resolution_m}\ndata\n"
        )
    }
}

impl NodeFormat {
    fn of(is_full: bool, id: &str) -> Result<Self, OctreeError> {
        match (is_full, id) {
            (false, "OcTree" | "OcTreeStamped" | "ColorOcTree") => Ok(Self::States),
            (true, "OcTree" | "OcTreeStamped") => Ok(Self::LogOdds { ignored_bytes: 0 }),
            (true, "ColorOcTree") => Ok(Self::LogOdds { ignored_bytes: 3 }),
            _ => Err(OctreeError::Type(excerpt(id))),
        }
    }
}

/// The next line with its end, at most [`LINE_BYTES_MAX`] of it.
fn line(file: &mut Counted<impl BufRead>) -> Result<String, OctreeError> {
    let mut bytes = Vec::new();
    file.take(LINE_BYTES_MAX).read_until(b'\n', &mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn not_a(what: &str, keyword: &str, value: &str) -> String {
    format!("{keyword} must be a {what}, got {:?}", excerpt(value))
}
