//! Section `threads` of the settings.

use serde::{Deserialize, Serialize};

/// Numbers of threads for work that uses the CPU; 0 means one for each core.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ThreadsConfig {
    /// Threads for queries, listings and descriptions; and as many for planners' questions.
    pub query: usize,
    /// Threads for planners' questions while robots insert scans, and for a second after; 0 means half of `query`.
    pub planning_beside_robots: usize,
    /// Threads for insertions, with their alignments, and deletions.
    pub mapping: usize,
    /// Threads for alignments of scans that are not inserted, which a key of scope read may ask for. 1.
    pub alignment: usize,
    /// Threads for localization without a guess, which takes seconds and much memory each time. 1.
    pub localization: usize,
}

impl Default for ThreadsConfig {
    fn default() -> Self {
        Self { query: 0, planning_beside_robots: 0, mapping: 0, alignment: 1, localization: 1 }
    }
}
