//! `mrol import`: a map of what another program made.

mod cloud;
mod command;
mod e57;
mod imported;
mod las;
mod npz;
mod octree;
mod options;

pub(super) use command::Import;
