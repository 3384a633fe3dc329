//! Who is let in, and what is let in: keys, certificates, limits, and inputs that fuzzing found.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod admission;
mod authorization;
mod forwarding;
mod fuzz_corpus;
#[path = "../support/mod.rs"]
mod support;
mod tls;
