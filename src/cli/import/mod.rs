//! `mrol import`: a map of what another program made.

mod cloud;
mod command;
mod imported;

pub(super) use command::Import;
