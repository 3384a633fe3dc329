//! Files that others wrote, files that others read, and damaged ones.

mod arrays;
mod damaged_octrees;
mod octrees;
mod support;
#[cfg(feature = "surveys")]
mod surveys;
