//! Section `threads` of the settings.

use mrol_service::section;

/// The most threads of one kind.
const THREADS_MAX: u32 = 1024;

section! {
    /// Numbers of threads for work that uses the CPU.
    pub struct ThreadsConfig in "threads" {
        /// Threads for queries, listings and descriptions, and as many for planners' questions. 0 = one a core.
        query: usize = 0; none, from 0, to THREADS_MAX;
        /// Threads for planners' questions, and as many for long queries, listings and trajectories, while robots
        /// insert scans and for a second after. 0 = half of `query`, one at least.
        planning_beside_robots: usize = 0; none, from 0, to THREADS_MAX;
        /// Threads for insertions, with their alignments, and deletions. 0 = one a core.
        mapping: usize = 0; none, from 0, to THREADS_MAX;
        /// Threads for alignments of scans that are not inserted, which a key of scope read may ask for. 0 = one a
        /// core.
        alignment: usize = 1; none, from 0, to THREADS_MAX;
        /// Threads for searches with no guess, which take seconds and much memory each. 0 = one a core.
        localization: usize = 1; none, from 0, to THREADS_MAX;
    }
}
