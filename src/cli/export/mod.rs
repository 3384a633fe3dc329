//! `mrol export`: a map as a file of another program.

mod cloud;
mod command;
mod exported;
mod recording;
mod source;

pub(super) use command::Export;
