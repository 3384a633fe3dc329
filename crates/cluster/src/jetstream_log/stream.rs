//! The stream of a map's log: made, found, cut and deleted.

use std::time::Duration;

use async_nats::jetstream::stream::{Config, DiscardPolicy, Republish, StorageType};
use serde::Serialize;
use serde::de::IgnoredAny;

use super::names::LogNames;
use crate::engine::{ApiError, CallError, Engine};

/// How long JetStream may take for a stream. To make one, its servers elect a leader; seen: 0.1 to 1.5 s.
const WITHIN: Duration = Duration::from_secs(5);

/// For how long ids are remembered: an attempt and some repetitions. More is of no use, since a repetition is told by
/// its place; and an id whose message its leader lost is answered "in process" for as long.
const IDS_REMEMBERED: Duration = Duration::from_secs(2);

/// Why a stream could not be made, found, cut or deleted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StreamError {
    /// There is none.
    #[error("NATS has no stream {0}")]
    Missing(String),
    /// NATS refused, or did not answer.
    #[error("stream {stream}: {cause}")]
    Failed {
        /// Its name.
        stream: String,
        /// What NATS said, or that it did not.
        cause: String,
    },
}

/// Makes the stream where there is none. One that is there stays as it is.
pub(super) async fn create(engine: &Engine, names: &LogNames) -> Result<(), StreamError> {
    match find(engine, names).await {
        Err(StreamError::Missing(_)) => {}
        found => return found,
    }
    let config = config_of(names, engine.replicas());
    ask(engine, names, "CREATE", &config).await
}

/// Makes sure that there is one.
pub(super) async fn find(engine: &Engine, names: &LogNames) -> Result<(), StreamError> {
    ask(engine, names, "INFO", &()).await
}

/// Deletes the messages before this one, which stays.
pub(super) async fn cut_before(engine: &Engine, names: &LogNames, sequence: u64) -> Result<(), StreamError> {
    #[derive(Serialize)]
    struct Purge {
        seq: u64,
    }
    ask(engine, names, "PURGE", &Purge { seq: sequence }).await
}

/// Deletes the stream, where there is one.
pub(super) async fn delete(engine: &Engine, names: &LogNames) -> Result<(), StreamError> {
    match ask(engine, names, "DELETE", &()).await {
        Err(StreamError::Missing(_)) => Ok(()),
        done => done,
    }
}

async fn ask(
    engine: &Engine,
    names: &LogNames,
    what: &str,
    question: &impl Serialize,
) -> Result<(), StreamError> {
    let stream = names.stream.clone();
    let endpoint = format!("STREAM.{what}.{stream}");
    match engine.call::<IgnoredAny>(&endpoint, question, WITHIN).await {
        Ok(_) => Ok(()),
        Err(CallError::Api(ApiError { err_code: ApiError::NO_STREAM, .. })) => {
            Err(StreamError::Missing(stream))
        }
        Err(error) => Err(StreamError::Failed { stream, cause: error.to_string() }),
    }
}

fn config_of(names: &LogNames, replicas: usize) -> Config {
    Config {
        name: names.stream.clone(),
        description: Some("The changes of a map, in order".to_owned()),
        subjects: vec![names.subjects()],
        num_replicas: replicas,
        storage: StorageType::File,
        // A stream that is full refuses: what it has is not given up for what is new.
        discard: DiscardPolicy::New,
        duplicate_window: IDS_REMEMBERED,
        allow_direct: true,
        deny_delete: true,
        republish: Some(Republish {
            source: names.subjects(),
            destination: names.news.clone(),
            headers_only: true,
        }),
        ..Config::default()
    }
}
