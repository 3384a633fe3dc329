//! Questions for several messages of a stream at once, which any of its replicas answers.

use std::time::Duration;

use async_nats::{HeaderMap, Message, StatusCode};
use bytes::Bytes;
use serde::Serialize;
use tokio_stream::StreamExt;

use super::connection::Engine;
use super::request::Unanswered;

/// A message of a stream.
#[derive(Debug)]
pub(crate) struct BatchMessage {
    /// Its number in the stream.
    pub(crate) sequence: u64,
    /// Its headers, and those that NATS adds.
    pub(crate) headers: HeaderMap,
    /// What it holds.
    pub(crate) payload: Bytes,
}

/// Why there is no batch.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum BatchError {
    /// No answer.
    #[error(transparent)]
    Unanswered(#[from] Unanswered),
    /// The question was refused.
    #[error("NATS refuses to read from stream {stream}: {description} ({status})")]
    Refused {
        /// The stream.
        stream: String,
        /// Which status.
        status: u16,
        /// In words.
        description: String,
    },
    /// An answer cannot be read.
    #[error("an answer from stream {0} has no Nats-Sequence")]
    Unreadable(String),
}

/// The end of a batch.
const END: u16 = 204;
/// There are no such messages.
const NOT_FOUND: u16 = 404;

impl Engine {
    /// Asks one replica of a stream for messages. It may lag behind the others, and what it has may be none. Each
    /// message is waited for so long at most; those that came in time are given where one did not.
    pub(crate) async fn batch(
        &self,
        stream: &str,
        question: &impl Serialize,
        within: Duration,
    ) -> Result<Vec<BatchMessage>, BatchError> {
        let failed = |error: &dyn std::error::Error| Unanswered::Failed(error.to_string());
        let question = serde_json::to_vec(question).map_err(|error| failed(&error))?;
        let client = self.client();
        let asked = async {
            self.connected().await;
            let inbox = client.new_inbox();
            let answers = client.subscribe(inbox.clone()).await.map_err(|error| failed(&error))?;
            let subject = format!("$JS.API.DIRECT.GET.{stream}");
            client
                .publish_with_reply(subject, inbox, question.into())
                .await
                .map_err(|error| failed(&error))?;
            Ok::<_, Unanswered>(answers)
        };
        let mut answers =
            tokio::time::timeout(within, asked).await.map_err(|_| Unanswered::TimedOut(within))??;
        let mut messages = Vec::new();
        loop {
            let answer = match tokio::time::timeout(within, answers.next()).await {
                Ok(Some(answer)) => answer,
                Ok(None) | Err(_) if !messages.is_empty() => return Ok(messages),
                Ok(None) => return Err(Unanswered::Failed("the connection to NATS ended".to_owned()).into()),
                Err(_) => return Err(Unanswered::TimedOut(within).into()),
            };
            match answer.status.map(u16::from) {
                None => messages.push(read(stream, answer)?),
                Some(END | NOT_FOUND) => return Ok(messages),
                Some(status) if status == u16::from(StatusCode::NO_RESPONDERS) => {
                    return Err(Unanswered::NoResponders(stream.to_owned()).into());
                }
                Some(status) => {
                    let description = answer.description.unwrap_or_default();
                    return Err(BatchError::Refused { stream: stream.to_owned(), status, description });
                }
            }
        }
    }
}

fn read(stream: &str, answer: Message) -> Result<BatchMessage, BatchError> {
    let headers = answer.headers.unwrap_or_default();
    let sequence = headers.get("Nats-Sequence").and_then(|value| value.as_str().parse().ok());
    let sequence = sequence.ok_or_else(|| BatchError::Unreadable(stream.to_owned()))?;
    Ok(BatchMessage { sequence, headers, payload: answer.payload })
}
