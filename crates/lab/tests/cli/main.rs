//! The lab's command line as a process: what it prints, which files it writes, and its exit codes.
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod bench;
mod experiment;
mod help;
#[path = "../../../../tests/support/program.rs"]
#[allow(clippy::allow_attributes, unreachable_pub, reason = "a test has no crate to reach it from")]
mod program;
#[path = "../../../../tests/support/sequence.rs"]
#[allow(clippy::allow_attributes, dead_code, unreachable_pub, reason = "shared with the tests of `mrol`")]
mod sequence;

use assert_cmd::Command;
use program::{Program, number, texts};
use sequence::Sequence;
use serde_json::Value;

const PROGRAM: Program = Program(env!("CARGO_BIN_EXE_mrol-lab"));

/// A call of the program, away from the caller's settings.
fn lab(arguments: &[&str]) -> Command {
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
