//! What the repository says of itself: layers of the code, the contract of the last release, commands of the documents.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod crates;
mod documents;
mod first_commands;
mod layering;
mod proto_compatibility;
#[path = "../support/mod.rs"]
mod support;
mod vocabulary;
