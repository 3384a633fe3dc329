//! Files that others wrote, files that others read, and damaged ones.
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod arrays;
mod damaged_octrees;
mod octrees;
mod support;
#[cfg(feature = "surveys")]
mod surveys;
