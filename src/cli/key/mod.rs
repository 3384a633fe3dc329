//! `mrol key`: manages the keys of callers.

mod change;
mod command;
mod list;

pub(crate) use command::Keys;
