//! Questions to JetStream, in JSON.

use std::time::Duration;

use async_nats::HeaderMap;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::connection::Engine;
use super::request::Unanswered;

/// What JetStream says when it does not do what it was asked.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, thiserror::Error)]
#[error("JetStream: {description} ({err_code})")]
pub(crate) struct ApiError {
    /// Which error; stable across versions.
    #[serde(default)]
    pub(crate) err_code: u32,
    /// In words.
    #[serde(default)]
    pub(crate) description: String,
}

/// Why a question to JetStream has no good answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum CallError {
    /// None at all.
    #[error(transparent)]
    Unanswered(#[from] Unanswered),
    /// An error.
    #[error(transparent)]
    Api(#[from] ApiError),
    /// One that cannot be read.
    #[error("an answer of JetStream cannot be read: {0}")]
    Unreadable(String),
}

impl ApiError {
    /// There is no such message.
    pub(crate) const NO_MESSAGE: u32 = 10037;
    /// There is no such stream.
    pub(crate) const NO_STREAM: u32 = 10059;
    /// The servers have no leader (yet).
    const NO_LEADER: u32 = 10008;
    /// The stream's last sequence, or that of a subject, is not what was expected.
    const WRONG_LAST_SEQUENCE: u32 = 10071;
    /// The same, of a subject with a message on its way.
    const WRONG_LAST_SEQUENCE_ON_ITS_WAY: u32 = 10164;
    /// A message of this id is on its way, or was lost or refused moments ago.
    const ID_IN_PROCESS: u32 = 10158;

    /// True where the servers have no leader (yet).
    pub(crate) fn is_no_leader(&self) -> bool {
        self.err_code == Self::NO_LEADER
    }

    /// True where the id of a message is known, and what became of it is not.
    pub(crate) fn is_id_in_process(&self) -> bool {
        self.err_code == Self::ID_IN_PROCESS
    }

    /// True where the last sequence of a stream or subject is not what was expected.
    pub(crate) fn is_wrong_last_sequence(&self) -> bool {
        [Self::WRONG_LAST_SEQUENCE, Self::WRONG_LAST_SEQUENCE_ON_ITS_WAY].contains(&self.err_code)
    }
}

impl Engine {
    /// Asks JetStream: `endpoint` is such as `STREAM.INFO.NAME`, and `()` is an empty question.
    pub(crate) async fn call<A: DeserializeOwned>(
        &self,
        endpoint: &str,
        question: &impl Serialize,
        within: Duration,
    ) -> Result<A, CallError> {
        let mut question =
            serde_json::to_vec(question).map_err(|error| CallError::Unreadable(error.to_string()))?;
        if question == b"null" {
            question.clear();
        }
        let subject = format!("$JS.API.{endpoint}");
        let answer = self.request(&subject, HeaderMap::new(), question.into(), within).await?;
        read_answer(&answer.payload)
    }
}

/// Reads an answer of JetStream: an error, or what was asked for.
pub(crate) fn read_answer<A: DeserializeOwned>(payload: &[u8]) -> Result<A, CallError> {
    #[derive(Deserialize)]
    struct Failed {
        error: Option<ApiError>,
    }
    let unreadable = |error: serde_json::Error| CallError::Unreadable(error.to_string());
    if let Some(error) = serde_json::from_slice::<Failed>(payload).map_err(unreadable)?.error {
        return Err(error.into());
    }
    serde_json::from_slice(payload).map_err(unreadable)
}
