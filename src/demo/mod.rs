//! `mrol demo`: shows mapping and queries without anything to download.
//!
//! Two simulated robots ray-cast scans of a furnished building and stream them over gRPC, at once, into one map
//! of the real daemon, while a planner asks about it. At the end a cart sends a scan that is refused. Everything
//! printed is measured.

mod checks;
mod command;
mod daemon;
mod explore;
mod explorer;
mod guide;
mod journal;
mod planner;
mod report;
mod robot;
mod stray;
mod summary;

pub(crate) use command::Demo;
