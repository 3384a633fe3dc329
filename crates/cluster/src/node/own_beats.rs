//! A node's own beats, as long as no other process beats under its name.

use std::time::{Duration, Instant};

use mrol_service::replication::NodeName;

use crate::beat::Beat;
use crate::beats::{BEAT_EVERY, Beats};
use crate::bucket::BucketError;

/// How long a beat of another process under this name stays as it is before it is of one that is gone: longer than the
/// other nodes wait.
const SILENT_AFTER: Duration = BEAT_EVERY.saturating_mul(4).saturating_add(Duration::from_secs(1));

/// Puts a node's beats, each in the place of its last: who finds another there was not alone.
pub(super) struct OwnBeats {
    beats: Beats,
    node: NodeName,
    /// Revision of the last.
    last: Option<u64>,
    /// A beat of another process, and since when it is there.
    other: Option<(u64, Instant)>,
}

/// Why a beat was not put.
#[derive(Debug, thiserror::Error)]
pub(super) enum NotPut {
    /// Nobody acknowledged it.
    #[error(transparent)]
    Unavailable(#[from] BucketError),
    /// The name is another's.
    #[error(
        "a process at {0} has beaten as this node: if that was this node before it was restarted, it is waited for nine \
         seconds; if it is another, give one of the two another name, and a folder of its own"
    )]
    OtherProcess(String),
}

impl OwnBeats {
    pub(super) fn new(beats: Beats, node: NodeName) -> Self {
        Self { beats, node, last: None, other: None }
    }

    /// Puts a beat; its revision. Under a name that another process has, at another address, nothing is put: the one
    /// that came first goes on.
    pub(super) fn put(&mut self, beat: &Beat) -> Result<u64, NotPut> {
        let put = match self.last {
            Some(last) => self.beats.put_after(&self.node, beat, last),
            None => Err(BucketError::Changed),
        };
        let revision = match put {
            // It was not acknowledged and is there, an older copy of the bucket was put back, or it is another's.
            Err(BucketError::Changed) => {
                self.check_alone(beat)?;
                self.beats.put(&self.node, beat)?
            }
            put => put?,
        };
        (self.last, self.other) = (Some(revision), None);
        Ok(revision)
    }

    /// Refuses where the last beat under this name is of another process that is not known to be gone.
    fn check_alone(&mut self, own: &Beat) -> Result<(), NotPut> {
        let there = self.beats.read()?.into_iter().find(|there| there.node == self.node);
        let Some(there) = there.filter(|there| there.beat.grpc != own.grpc && !there.beat.has_ended) else {
            return Ok(());
        };
        let same = self.other.filter(|(revision, _)| *revision == there.revision);
        let (_, since) = *self.other.insert(same.unwrap_or((there.revision, Instant::now())));
        match since.elapsed() > SILENT_AFTER {
            true => Ok(()),
            false => Err(NotPut::OtherProcess(there.beat.grpc)),
        }
    }
}
