//! Who follows a map: those who wait for a revision, and those who watch its changes.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;

use super::full_state::FullStates;
use crate::commit::{CommitQueue, Lead, Published, RecentChanges};
use mrol_map::map::ContentHistory;

/// Everything that the followers of a map read.
#[derive(Debug)]
pub(crate) struct Followers {
    /// The last revision that was published.
    announced: watch::Receiver<u64>,
    /// The last changes, for the map's watchers.
    pub(crate) recent: Arc<RecentChanges>,
    /// Whole states that watchers are being told of.
    pub(crate) whole_states: FullStates,
}

impl Followers {
    /// Those of a map at `revision` with this history, of whose changes so many bytes are kept, and where its thread
    /// publishes to them.
    pub(super) fn new(revision: u64, history: ContentHistory, watch_bytes_max: usize) -> (Self, Published) {
        let (announcing, announced) = watch::channel(revision);
        let recent = Arc::new(RecentChanges::new(revision, history, watch_bytes_max));
        let lead = watch::Sender::new(Lead::Alone);
        let published = Published { announced: announcing, recent: Arc::clone(&recent), lead };
        (Self { announced, recent, whole_states: FullStates::default() }, published)
    }

    /// Waits until `revision` is there; false where `wait_max` is over first, or the map ends, of which waiters hear
    /// at once.
    pub(super) async fn wait_for_revision(
        &self,
        revision: u64,
        wait_max: Duration,
        commit_queue: &CommitQueue,
    ) -> bool {
        let mut announced = self.announced.clone();
        let reached = async {
            tokio::select! {
                biased;
                reached = async { announced.wait_for(|announced| *announced >= revision).await.is_ok() } => reached,
                () = commit_queue.ended() => false,
            }
        };
        matches!(tokio::time::timeout(wait_max, reached).await, Ok(true))
    }
}
