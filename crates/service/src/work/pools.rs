//! The pools of threads, one for each kind of work: what keeps one kind waiting keeps no other.

use super::pool::{Pool, PoolUse};
use crate::error::ServiceError;
use crate::settings::ServiceSettings;

/// Of the jobs that may wait for a thread, one in so many may wait for one of [`Pools::long_mapping`].
const LONG_SHARE: usize = 4;
/// Threads of the pools where each job takes memory as a part of a map or of a journal does: one at a time.
const ONE_AT_A_TIME: usize = 1;

/// The pools of threads.
#[derive(Debug)]
pub(crate) struct Pools {
    /// For queries, listings and descriptions, so that no alignment starves them.
    pub(crate) queries: Pool,
    /// For insertions, with their alignments, and deletions. Nothing else: whatever others ask for, robots map.
    pub(crate) mapping: Pool,
    /// For scans that take long, since they do not fit from their guess: a second and more each, while robots whose
    /// scans fit map on.
    pub(crate) long_mapping: Pool,
    /// For alignments of scans that are not inserted: a key for reading may ask for any number of them.
    pub(crate) alignment: Pool,
    /// For searches with no guess, which take seconds: no alignment waits for them.
    pub(crate) localization: Pool,
    /// For searches for lost robots, which nobody waits for.
    pub(crate) recovery: Pool,
    /// For finding out what an undo takes back, which reads a snapshot and the journal behind it.
    pub(crate) undo: Pool,
    /// For map files, out of the server and in, which take seconds and much memory each: no query or scan waits for
    /// them.
    pub(crate) map_files: Pool,
    /// For what watches are told of besides the last changes: whole states, and changes that the journal has.
    pub(crate) watch: Pool,
    /// For finding the scans that touched a voxel, which may read much of the journal.
    pub(crate) observers: Pool,
    /// For blocks, which take up to seconds: no query of points waits for them.
    pub(crate) blocks: Pool,
    /// For what planners ask besides points: no query of points waits for a long one.
    pub(crate) planning: Pool,
}

impl Pools {
    /// Starts the threads.
    ///
    /// # Errors
    /// When the system refuses.
    pub(crate) fn start(settings: &ServiceSettings) -> Result<Self, ServiceError> {
        let waiting = settings.limits.jobs_waiting_max;
        let mapping = Pool::new("mapping", settings.mapping_threads, waiting)?;
        let localization = Pool::new("localization", settings.localization_threads, waiting)?;
        let queries = Pool::new("query", settings.query_threads, waiting)?;
        Ok(Self {
            long_mapping: Pool::beside("long_mapping", &mapping, waiting.div_ceil(LONG_SHARE))?,
            alignment: Pool::new("alignment", settings.alignment_threads, waiting)?,
            recovery: Pool::beside("recovery", &localization, 0)?,
            undo: Pool::new("undo", ONE_AT_A_TIME, waiting)?,
            map_files: Pool::new("map_file", ONE_AT_A_TIME, waiting)?,
            watch: Pool::new("watch", ONE_AT_A_TIME, waiting.max(settings.limits.watches_max))?,
            observers: Pool::new("observers", ONE_AT_A_TIME, waiting)?,
            blocks: Pool::beside("blocks", &queries, waiting)?,
            planning: Pool::new("planning", settings.query_threads, waiting)?,
            queries,
            mapping,
            localization,
        })
    }

    /// What the threads are doing.
    pub(crate) fn in_use(&self) -> [PoolUse; 12] {
        let all = [
            &self.queries,
            &self.mapping,
            &self.long_mapping,
            &self.alignment,
            &self.localization,
            &self.recovery,
            &self.undo,
            &self.map_files,
            &self.watch,
            &self.observers,
            &self.blocks,
            &self.planning,
        ];
        all.map(Pool::in_use)
    }
}
