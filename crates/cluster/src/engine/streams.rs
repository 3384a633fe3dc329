//! Streams: made, found, cut and deleted.

use std::time::Duration;

use async_nats::jetstream::stream::Config;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use super::api::{ApiError, CallError};
use super::connection::Engine;

/// How long JetStream may take for a stream. To make one, its servers elect a leader; seen: 0.1 to 1.5 s.
const WITHIN: Duration = Duration::from_secs(5);

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

/// What is in a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub struct StreamState {
    /// Messages.
    pub messages: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Number of the last.
    #[serde(rename = "last_seq")]
    pub last_sequence: u64,
}

/// The servers that keep a stream.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct StreamServers {
    /// How many are to keep it.
    pub replicas: usize,
    /// The one that leads it; none while they elect one. Unknown of a NATS server by itself.
    pub leader: Option<String>,
    /// Those that lack what the leader has, or are not reached.
    pub behind: Vec<String>,
}

impl Engine {
    /// Makes a stream where there is none. One that is there stays as it is.
    pub(crate) async fn create_stream(&self, config: &Config) -> Result<(), StreamError> {
        match self.find_stream(&config.name).await {
            Err(StreamError::Missing(_)) => self.ask_of_stream("CREATE", &config.name, config).await,
            found => found,
        }
    }

    /// Makes sure that there is a stream.
    pub(crate) async fn find_stream(&self, stream: &str) -> Result<(), StreamError> {
        self.ask_of_stream("INFO", stream, &()).await
    }

    /// What is in a stream, as its leader says.
    pub(crate) async fn stream_state(&self, stream: &str) -> Result<StreamState, StreamError> {
        #[derive(Deserialize)]
        struct Info {
            state: StreamState,
        }
        let info = self.call::<Info>(&format!("STREAM.INFO.{stream}"), &(), WITHIN).await;
        info.map(|info| info.state).map_err(|error| failed_of(stream, error))
    }

    /// The servers that keep a stream, as its leader says.
    pub(crate) async fn stream_servers(&self, stream: &str) -> Result<StreamServers, StreamError> {
        #[derive(Deserialize)]
        struct Info {
            config: Kept,
            #[serde(default)]
            cluster: Servers,
        }
        #[derive(Deserialize)]
        struct Kept {
            num_replicas: usize,
        }
        #[derive(Default, Deserialize)]
        struct Servers {
            leader: Option<String>,
            #[serde(default)]
            replicas: Vec<Replica>,
        }
        #[derive(Deserialize)]
        struct Replica {
            name: String,
            #[serde(default)]
            current: bool,
            #[serde(default)]
            offline: bool,
        }
        let info = self.call::<Info>(&format!("STREAM.INFO.{stream}"), &(), WITHIN).await;
        let Info { config, cluster } = info.map_err(|error| failed_of(stream, error))?;
        let behind = cluster.replicas.into_iter().filter(|replica| replica.offline || !replica.current);
        Ok(StreamServers {
            replicas: config.num_replicas,
            leader: cluster.leader,
            behind: behind.map(|replica| replica.name).collect(),
        })
    }

    /// Deletes the messages of a stream before this one, which stays.
    pub(crate) async fn cut_stream(&self, stream: &str, before: u64) -> Result<(), StreamError> {
        #[derive(Serialize)]
        struct Purge {
            seq: u64,
        }
        self.ask_of_stream("PURGE", stream, &Purge { seq: before }).await
    }

    /// Deletes a stream, where there is one.
    pub(crate) async fn delete_stream(&self, stream: &str) -> Result<(), StreamError> {
        match self.ask_of_stream("DELETE", stream, &()).await {
            Err(StreamError::Missing(_)) => Ok(()),
            done => done,
        }
    }

    async fn ask_of_stream(
        &self,
        what: &str,
        stream: &str,
        question: &impl Serialize,
    ) -> Result<(), StreamError> {
        let endpoint = format!("STREAM.{what}.{stream}");
        match self.call::<IgnoredAny>(&endpoint, question, WITHIN).await {
            Ok(_) => Ok(()),
            Err(error) => Err(failed_of(stream, error)),
        }
    }
}

fn failed_of(stream: &str, error: CallError) -> StreamError {
    match error {
        CallError::Api(ApiError { err_code: ApiError::NO_STREAM, .. }) => {
            StreamError::Missing(stream.to_owned())
        }
        error => StreamError::Failed { stream: stream.to_owned(), cause: error.to_string() },
    }
}
