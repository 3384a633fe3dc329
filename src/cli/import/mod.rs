//! `mrol import`: a map of what another program made.

mod cloud;
mod command;
mod imported;
mod npz;
mod octree;
mod options;

pub(super) use command::Import;
