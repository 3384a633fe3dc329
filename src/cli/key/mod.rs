//! `mrol key`: manages the keys of callers.

mod change;
mod command;
mod list;
mod name;

pub(crate) use command::Keys;
