//! The command line: the daemon, a demonstration of it, mapping without it, and calls to it.
//!
//! Results go to standard output, a line each, as text or (`--json`) as JSON objects; everything else goes to
//! standard error. The exit code is 0 when all went well, 1 when something failed, 2 for a command line that
//! makes no sense, and 3 when a scan was answered and not accepted (`insert` and `localize`).

mod alignment_options;
mod block;
mod check;
mod classify;
#[cfg(feature = "cluster")]
mod cluster;
#[cfg(not(feature = "cluster"))]
#[path = "no_cluster.rs"]
mod cluster;
mod command_line;
mod completions;
mod config;
mod confirmation;
mod delete;
mod doctor;
mod events;
mod export;
mod frontiers;
mod grid;
mod health;
mod import;
mod insert;
mod keepout;
mod key;
mod lab;
mod localize;
#[cfg(feature = "logs")]
mod log;
mod man;
mod map;
mod map_source;
mod maps;
mod met;
mod nearest;
mod observers;
mod query;
mod rays;
mod remote;
mod scan_file_options;
mod scan_report;
mod scope;
mod snapshot;
mod survey;
mod undo;
mod watch;

pub(crate) use command_line::run;
