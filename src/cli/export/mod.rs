//! `mrol export`: a map as a file of another program.

mod cloud;
mod command;
mod exported;
mod free_space;
mod npz;
mod octree;
mod recording;
mod source;
mod survey;

pub(super) use command::Export;
