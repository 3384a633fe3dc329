//! Values by key, changed by compare-and-set.

use std::time::Duration;

use async_nats::HeaderMap;
use async_nats::jetstream::stream::{Config, DiscardPolicy, StorageType};
use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::engine::{BatchMessage, CallError, Engine, StreamError, read_answer};

/// How long a request waits. Three servers acknowledge within milliseconds, and callers come again.
const WITHIN: Duration = Duration::from_millis(500);

/// Keys that are read at once: NATS gives no more. A map is a key, and so is a node.
const KEYS_MAX: usize = 1_024;

/// The last revision of a key, as the writer knows it.
const EXPECTED_LAST: &str = "Nats-Expected-Last-Subject-Sequence";
/// Says that a message is the deletion of its key.
const OPERATION: &str = "KV-Operation";

/// Values by key, on as many servers as each stream; the newest of each only. A bucket as all clients of NATS know it.
#[derive(Debug, Clone)]
pub struct Bucket {
    engine: Engine,
    name: &'static str,
}

/// A key with its value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BucketEntry {
    /// The key.
    pub key: String,
    /// Of the bucket when the value was put: what the next change expects.
    pub revision: u64,
    /// The value.
    pub value: Bytes,
}

/// Why a value was not read or put.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BucketError {
    /// The key's revision is not the one that was expected.
    #[error("the key was changed by another")]
    Changed,
    /// No answer. What was to be put may be there, or come.
    #[error("bucket {bucket}: {cause}")]
    Unavailable {
        /// Its name.
        bucket: String,
        /// What NATS said, or that it did not.
        cause: String,
    },
}

impl Bucket {
    /// The bucket of this name, which is made where there is none.
    ///
    /// # Errors
    /// Says what NATS said.
    pub fn create(engine: &Engine, name: &'static str) -> Result<Self, StreamError> {
        let this = Self { engine: engine.clone(), name };
        engine.block_on(engine.create_stream(&this.config()))?;
        Ok(this)
    }

    /// Puts a value, and says its revision. With `expected`, only where the key's revision is this one: 0 where there
    /// is no such key. Without, in any case.
    ///
    /// # Errors
    /// [`BucketError::Changed`], or that nobody answered.
    pub fn put(&self, key: &str, value: Bytes, expected: Option<u64>) -> Result<u64, BucketError> {
        let mut headers = HeaderMap::new();
        if let Some(revision) = expected {
            headers.insert(EXPECTED_LAST, revision.to_string());
        }
        self.publish(key, value, headers)
    }

    /// Deletes a key, if its revision is this one.
    ///
    /// # Errors
    /// [`BucketError::Changed`], or that nobody answered.
    pub fn delete(&self, key: &str, expected: u64) -> Result<(), BucketError> {
        let mut headers = HeaderMap::new();
        headers.insert(EXPECTED_LAST, expected.to_string());
        headers.insert(OPERATION, "DEL");
        self.publish(key, Bytes::new(), headers).map(|_| ())
    }

    /// Reads a key from one of the servers, which may lag behind the others.
    ///
    /// # Errors
    /// Nobody answered.
    pub fn read(&self, key: &str) -> Result<Option<BucketEntry>, BucketError> {
        self.read_matching(key).map(|mut entries| entries.pop())
    }

    /// The revision of a key's last change, its deletion too; 0 where there was none. From one of the servers.
    ///
    /// # Errors
    /// Nobody answered.
    pub fn last_revision(&self, key: &str) -> Result<u64, BucketError> {
        Ok(self.messages_of(key)?.last().map_or(0, |message| message.sequence))
    }

    /// Reads all keys from one of the servers, which may lag behind the others.
    ///
    /// # Errors
    /// Nobody answered.
    pub fn read_all(&self) -> Result<Vec<BucketEntry>, BucketError> {
        self.read_matching(">")
    }

    fn read_matching(&self, keys: &str) -> Result<Vec<BucketEntry>, BucketError> {
        let found = self.messages_of(keys)?;
        Ok(found.into_iter().filter_map(|message| self.entry_of(message)).collect())
    }

    /// The last message of each key, deletions among them.
    fn messages_of(&self, keys: &str) -> Result<Vec<BatchMessage>, BucketError> {
        #[derive(Serialize)]
        struct Question {
            multi_last: [String; 1],
            batch: usize,
        }
        let question = Question { multi_last: [self.subject(keys)], batch: KEYS_MAX };
        let found = self.engine.block_on(self.engine.batch(&self.stream(), &question, WITHIN));
        found.map_err(|error| self.unavailable(&error))
    }

    fn publish(&self, key: &str, value: Bytes, headers: HeaderMap) -> Result<u64, BucketError> {
        #[derive(Deserialize)]
        struct Acknowledgment {
            seq: u64,
        }
        let subject = self.subject(key);
        let answer = self.engine.block_on(self.engine.request(&subject, headers, value, WITHIN));
        let answer = answer.map_err(|error| self.unavailable(&error))?;
        match read_answer::<Acknowledgment>(&answer.payload) {
            Ok(acknowledged) => Ok(acknowledged.seq),
            Err(CallError::Api(error)) if error.is_wrong_last_sequence() => Err(BucketError::Changed),
            Err(error) => Err(self.unavailable(&error)),
        }
    }

    /// The entry that a message is, unless it is a deletion.
    fn entry_of(&self, message: BatchMessage) -> Option<BucketEntry> {
        let subject = message.headers.get("Nats-Subject")?.as_str();
        let key = subject.strip_prefix(&self.subject(""))?.to_owned();
        let is_there = message.headers.get(OPERATION).is_none();
        is_there.then_some(BucketEntry { key, revision: message.sequence, value: message.payload })
    }

    fn stream(&self) -> String {
        format!("KV_{}", self.name)
    }

    /// The subject of a key.
    pub(crate) fn subject(&self, key: &str) -> String {
        format!("$KV.{}.{key}", self.name)
    }

    fn unavailable(&self, error: &dyn std::error::Error) -> BucketError {
        BucketError::Unavailable { bucket: self.name.to_owned(), cause: error.to_string() }
    }

    fn config(&self) -> Config {
        Config {
            name: self.stream(),
            subjects: vec![self.subject(">")],
            num_replicas: self.engine.replicas(),
            storage: StorageType::File,
            discard: DiscardPolicy::New,
            max_messages_per_subject: 1,
            allow_direct: true,
            deny_delete: true,
            allow_rollup: true,
            ..Config::default()
        }
    }
}
