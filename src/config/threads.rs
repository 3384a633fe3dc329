//! Threads for work that uses the CPU.

use serde::{Deserialize, Serialize};

/// Threads for work that uses the CPU; 0 = one a core.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ThreadsConfig {
    /// For queries, listings and descriptions.
    pub query: usize,
    /// For insertions, with their alignments, and deletions.
    pub mapping: usize,
    /// For alignments of scans that are not inserted, which a key for reading may ask for. 1.
    pub alignment: usize,
    /// For searches with no guess, which take seconds and much memory each. 1.
    pub localization: usize,
}

impl Default for ThreadsConfig {
    fn default() -> Self {
        Self { query: 0, mapping: 0, alignment: 1, localization: 1 }
    }
}
