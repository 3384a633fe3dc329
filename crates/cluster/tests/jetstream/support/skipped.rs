//! Tests that say they are skipped, past the harness, which shows what a test prints only where it fails.

use std::io::Write;

/// Says that the test of this thread is skipped, and why.
pub(crate) fn skipped(why: &str) {
    // The harness names a test's thread after the test, except where all run one after another on the main thread.
    let thread = std::thread::current();
    let test = thread.name().filter(|name| *name != "main").unwrap_or("a test");
    // In one piece, since other tests write too. The macros write into what the harness keeps back; a handle does not.
    let line = format!("SKIPPED {test}: {why}\n");
    let _ = std::io::stderr().write_all(line.as_bytes());
}
