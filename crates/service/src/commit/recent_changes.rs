//! The last changes of a map, kept in memory for its watchers.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use tokio::sync::watch;

use super::watched_change::WatchedChange;
use crate::request::WatchForm;
use mrol_map::map::{ContentHistory, ContentVersion, LevelSet, RevisionHashes, StateHash};
use mrol_map::sync::{Mutex, Rank};
use mrol_map::voxel::LEVELS_MAX;

/// The last changes of a map, in a ring of so many bytes: told to whoever watches, and made into bytes once for all of
/// them.
#[derive(Debug)]
pub(crate) struct RecentChanges {
    ring: Mutex<Ring>,
    bytes_max: usize,
    /// The last revision that is durable: nothing beyond it is told, so that no restart takes anything back.
    durable: watch::Sender<u64>,
    /// How many watch each level.
    watchers: [AtomicUsize; LEVELS_MAX as usize],
}

#[derive(Debug)]
struct Ring {
    /// Of consecutive revisions.
    changes: VecDeque<Arc<WatchedChange>>,
    bytes: usize,
    /// The map's revision.
    head: u64,
    /// The hashes of the last revisions, of more than there are changes of.
    history: ContentHistory,
}

/// Keeps a level among those that are watched.
#[derive(Debug)]
pub(crate) struct WatchedLevel {
    changes: Arc<RecentChanges>,
    level: u32,
}

impl RecentChanges {
    /// Those of a map at `revision`, which is durable, in at most `bytes_max` bytes.
    pub(crate) fn new(revision: u64, history: ContentHistory, bytes_max: usize) -> Self {
        let ring = Ring { changes: VecDeque::new(), bytes: 0, head: revision, history };
        Self {
            ring: Mutex::new(Rank::Brief, ring),
            bytes_max,
            durable: watch::Sender::new(revision),
            watchers: Default::default(),
        }
    }

    /// The levels that somebody watches.
    pub(super) fn levels(&self) -> LevelSet {
        let is_watched = |level: &u32| self.watchers[*level as usize].load(Ordering::Acquire) > 0;
        (0..LEVELS_MAX).filter(is_watched).collect()
    }

    /// Adds the change that made the next revision, after which all that a copy may hold has the hash `state`. The
    /// oldest go where there is no room; one that is too large for all of it leaves nothing.
    pub(super) fn push(&self, change: WatchedChange, state: StateHash) {
        let mut gone = Vec::new();
        let mut ring = self.ring.lock();
        (ring.head, ring.bytes) = (change.revision, ring.bytes + change.memory_bytes());
        if let Some(hash) = change.hash {
            ring.history.push(ContentVersion { revision: change.revision, hash }, state);
        }
        ring.changes.push_back(Arc::new(change));
        while ring.bytes > self.bytes_max {
            let Some(oldest) = ring.changes.pop_front() else { break };
            ring.bytes -= oldest.memory_bytes();
            // Given back when nobody waits for the lock any more.
            gone.push(oldest);
        }
        drop(ring);
    }

    /// Says that all changes up to `revision` are durable.
    pub(super) fn note_durable(&self, revision: u64) {
        self.durable.send_if_modified(|durable| {
            let is_newer = revision > *durable;
            *durable = revision.max(*durable);
            is_newer
        });
    }

    /// Follows the last revision that is durable.
    pub(crate) fn durable(&self) -> watch::Receiver<u64> {
        self.durable.subscribe()
    }

    /// The hashes of the last revisions.
    pub(crate) fn history(&self) -> ContentHistory {
        self.ring.lock().history.clone()
    }

    /// The hashes at `revision`; none where they are not known.
    pub(crate) fn hashes_at(&self, revision: u64) -> Option<RevisionHashes> {
        self.ring.lock().history.get(revision)
    }

    /// The change that made `revision`, if it is still here.
    pub(crate) fn get(&self, revision: u64) -> Option<Arc<WatchedChange>> {
        let ring = self.ring.lock();
        let first = ring.changes.front()?.revision;
        let at = usize::try_from(revision.checked_sub(first)?).ok()?;
        ring.changes.get(at).cloned()
    }

    /// True where a watcher at `revision` can be told of what came after it in this form.
    pub(crate) fn can_follow(&self, revision: u64, form: WatchForm) -> bool {
        let head = self.ring.lock().head;
        revision == head || self.get(revision + 1).is_some_and(|change| change.has(form))
    }

    /// Counts a watcher of `level`, from the next change on.
    pub(crate) fn watch_level(self: &Arc<Self>, level: u32) -> WatchedLevel {
        self.watchers[level as usize].fetch_add(1, Ordering::AcqRel);
        WatchedLevel { changes: Arc::clone(self), level }
    }
}

impl Drop for WatchedLevel {
    fn drop(&mut self) {
        self.changes.watchers[self.level as usize].fetch_sub(1, Ordering::AcqRel);
    }
}
