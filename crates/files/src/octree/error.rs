//! Why a file is no octree that can be used.

use std::io;

use mrol_map::voxel::{RESOLUTION_MAX_M, RESOLUTION_MIN_M};

use super::leaf::DEPTH;

/// Why the octree of a file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum OctreeError {
    /// The file is no octree.
    #[error(
        "no octree of OctoMap: its first line is {0:?}, where \"# Octomap OcTree binary file\" or \"# Octomap OcTree file\" \
         is needed"
    )]
    NoOctree(String),
    /// A line of the header is not as the format says.
    #[error("line {line} of its header: {problem}")]
    Header {
        /// Counted from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// The header lacks a line.
    #[error("its header has no line {0:?}")]
    Lacking(&'static str),
    /// A tree of a type whose nodes are unknown.
    #[error(
        "a tree of type {0}: OcTree, OcTreeStamped and ColorOcTree are read; `convert_octree` of OctoMap makes an OcTree \
         of others"
    )]
    Type(String),
    /// Cells that no map can have.
    #[error("cells of {0} m (res): those of a map are {RESOLUTION_MIN_M} to {RESOLUTION_MAX_M} m")]
    Resolution(f64),
    /// The file ends in the tree.
    #[error("the file ends after {nodes} of the {claimed} nodes that its header names: it was cut off")]
    CutOff {
        /// Nodes that are there.
        nodes: u64,
        /// Nodes of the header.
        claimed: u64,
    },
    /// The tree is deeper than any.
    #[error("node {0} lies below the {DEPTH} levels that a tree has: the file is damaged")]
    TooDeep(u64),
    /// A node that is no number.
    #[error("the log-odds of node {0} are not a number: the file is damaged")]
    NotANumber(u64),
    /// The tree has another number of nodes than its header says.
    #[error("its header names {claimed} nodes, and the tree has {nodes}: the file is damaged")]
    Nodes {
        /// Nodes that are there.
        nodes: u64,
        /// Nodes of the header.
        claimed: u64,
    },
    /// Something follows the tree.
    #[error("more follows the tree, which ends at byte {0}: the file is damaged, or is several in one")]
    Appended(u64),
    /// More voxels than a map is made of; the payload is the limit.
    #[error("its occupied cells are more than {0} voxels, the limit: take coarser ones by --resolution")]
    TooManyVoxels(u64),
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
}
