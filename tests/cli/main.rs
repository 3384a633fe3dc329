//! The command line as a process: what it prints, which files it writes, and its exit codes.
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod broken_connections;
#[cfg(feature = "cluster")]
mod cluster;
mod demo;
mod depth_images;
mod doctor;
mod errors;
mod files;
mod help;
mod local;
mod localize;
mod logs;
mod pose_files;
mod questions;
mod recordings;
mod remote;
#[path = "../support/mod.rs"]
mod support;
mod surveys;

use assert_cmd::Command;
use serde_json::Value;
use support::program::{Program, number};
use support::sequence::Sequence;

const PROGRAM: Program = Program(env!("CARGO_BIN_EXE_mrol"));

/// A call of the program, away from the caller's settings.
fn mrol(arguments: &[&str]) -> Command {
    PROGRAM.call(arguments)
}

/// The objects that a call prints, which must succeed.
fn objects(arguments: &[&str]) -> Vec<Value> {
    PROGRAM.objects(arguments)
}

/// What a call says on standard error, which must end with `code`.
fn complaint(arguments: &[&str], code: i32) -> String {
    PROGRAM.complaint(arguments, code)
}
