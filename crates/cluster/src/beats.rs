//! The last beat of each node.

use std::time::Duration;

use mrol_service::replication::NodeName;

use crate::beat::Beat;
use crate::bucket::{Bucket, BucketEntry, BucketError};
use crate::engine::{Engine, StreamError};

/// How often a node beats. Four of these are what a failure costs before another node claims; a beat of a node with a
/// hundred maps is 10 kB.
pub const BEAT_EVERY: Duration = Duration::from_secs(2);

/// The last beat of each node, in the bucket `mrol-beats`.
#[derive(Debug, Clone)]
pub struct Beats(Bucket);

/// A node's last beat.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeBeat {
    /// Whose.
    pub node: NodeName,
    /// Of the bucket; it changes with each beat.
    pub revision: u64,
    /// What it says.
    pub beat: Beat,
}

impl Beats {
    /// The bucket, which is made where there is none.
    ///
    /// # Errors
    /// Says what NATS said.
    pub fn create(engine: &Engine) -> Result<Self, StreamError> {
        Bucket::create(engine, "mrol-beats").map(Self)
    }

    /// Puts a node's beat, and says its revision once it is acknowledged.
    ///
    /// # Errors
    /// Nobody acknowledged it in time.
    pub fn put(&self, node: &NodeName, beat: &Beat) -> Result<u64, BucketError> {
        self.put_where(node, beat, None)
    }

    /// The same, if the last of that node is the one of this revision.
    ///
    /// # Errors
    /// [`BucketError::Changed`] where it is another, or nobody acknowledged it in time.
    pub fn put_after(&self, node: &NodeName, beat: &Beat, last: u64) -> Result<u64, BucketError> {
        self.put_where(node, beat, Some(last))
    }

    fn put_where(&self, node: &NodeName, beat: &Beat, last: Option<u64>) -> Result<u64, BucketError> {
        let value = serde_json::to_vec(beat).map_err(|error| BucketError::Unavailable {
            bucket: "mrol-beats".to_owned(),
            cause: error.to_string(),
        })?;
        self.0.put(node.as_str(), value.into(), last)
    }

    /// Reads the last beats of all nodes, from one of the servers. What is none is told to the log and left out.
    ///
    /// # Errors
    /// Nobody answered.
    pub fn read(&self) -> Result<Vec<NodeBeat>, BucketError> {
        Ok(self.0.read_all()?.iter().filter_map(node_beat_of).collect())
    }

    /// Deletes the last beat of a node that has left for good.
    ///
    /// # Errors
    /// It beat meanwhile, or nobody answered.
    pub fn remove(&self, last: &NodeBeat) -> Result<(), BucketError> {
        self.0.delete(last.node.as_str(), last.revision)
    }
}

fn node_beat_of(entry: &BucketEntry) -> Option<NodeBeat> {
    let node = NodeName::new(&entry.key).map_err(|error| error.to_string());
    let beat = serde_json::from_slice::<Beat>(&entry.value).map_err(|error| error.to_string());
    match (node, beat) {
        (Ok(node), Ok(beat)) => Some(NodeBeat { node, revision: entry.revision, beat }),
        (Err(error), _) | (_, Err(error)) => {
            tracing::warn!(key = entry.key, error, "a beat cannot be read");
            None
        }
    }
}
