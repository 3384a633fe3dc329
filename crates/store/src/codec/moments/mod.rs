//! Encoding of the moments of voxels: beside the voxels, or with keys of their own.

mod few_points;
mod forms;
mod moment_set;
mod steps;

pub(crate) use moment_set::{beside, read};
