//! Reads of a map: points, voxels, blocks, and the scans that touched a voxel.

mod block;
mod listing;
mod observers;
mod points;
