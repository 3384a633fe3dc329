//! Octrees of OctoMap: files `.bt` and `.ot`.
//!
//! A cell of the finest level is `resolution_m` wide, and cell i j k spans `[i, i + 1) * resolution_m` in x, and so on:
//! the lattice is that of a map. A tree has 16 levels above its cells, so that indices run from -32,768 to 32,767.
//!
//! ```text
//! # Octomap OcTree binary file          "# Octomap OcTree file" of `.ot`; other lines after a # are comments
//! id OcTree                             the type of the tree, which says what a node of `.ot` has
//! size 17                               nodes, leaves and the root among them
//! res 0.05                              side of a cell, meters
//! data                                  and the nodes, depth first, from here on
//!
//! .bt   each node that has children     u16, little-endian: two bits for each child, the first one's lowest
//!                                       0 unknown, 1 free, 2 occupied, 3 has children
//! .ot   each node                       f32, little-endian: log-odds that it is occupied
//!                                       (3 bytes of a color: of a ColorOcTree)
//!                                       u8: which children it has, the first one's bit lowest; 0 of a leaf
//! ```
//!
//! Child c of a node lies in the upper half in x where bit 0 of c is set, in y where bit 1 is, in z where bit 2 is.
//! Eight leaves of one state below a node are one leaf in the place of that node: they are pruned.
//!
//! Reading order: `leaf` is a cell and its place in the order of a file; `header`; `reader` gives the leaves of a file
//! one by one, `voxels` makes voxels of them; an `octree` is made of leaves, and `writer` writes it.
//! `blocks` are the cells of a box in the order of files.
//!
//! Source: Hornung et al., *OctoMap* (Autonomous Robots 2013), section 3.5, and the files that its library writes.

mod blocks;
mod error;
mod header;
mod leaf;
mod octree_of_leaves;
mod reader;
mod voxels;
mod writer;

pub use blocks::{CellBlock, CellBlocks};
pub use error::OctreeError;
pub use leaf::{CELL_INDEX_MAX, CELL_INDEX_MIN, CellState, Leaf, VOXELS_MAX};
pub use octree_of_leaves::{LeafError, Octree};
pub use reader::OctreeReader;
pub use voxels::OctreeVoxels;
pub use writer::{LOG_ODDS_FREE, LOG_ODDS_OCCUPIED};
