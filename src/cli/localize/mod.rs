//! `mrol localize`: finds where in a map a scan was taken, without a guess.

mod command;
mod report;

pub(crate) use command::Localize;
