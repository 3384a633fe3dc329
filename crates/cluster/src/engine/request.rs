//! Questions with a deadline.

use std::time::Duration;

use async_nats::client::{RequestError, RequestErrorKind};
use async_nats::{HeaderMap, Message, Request};
use bytes::Bytes;

use super::connection::Engine;

/// How often a lost connection is looked for: the library tells nobody who waits.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// Why a request has no answer. Whether it was received is not known, but for the first.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unanswered {
    /// Nobody listens: the stream has no leader, or there is no such stream.
    #[error("nobody at NATS answers for {0}: there is no leader now, or no such stream")]
    NoResponders(String),
    /// The time is over.
    #[error("NATS did not answer within {} ms", .0.as_millis())]
    TimedOut(Duration),
    /// Another failure of the connection.
    #[error("{0}")]
    Failed(String),
}

impl Engine {
    /// Asks, and waits for the answer for so long at most.
    pub(crate) async fn request(
        &self,
        subject: &str,
        headers: HeaderMap,
        payload: Bytes,
        within: Duration,
    ) -> Result<Message, Unanswered> {
        let request = Request::new().payload(payload).headers(headers).timeout(Some(within));
        let asked = async {
            self.connected().await;
            self.client().send_request(subject.to_owned(), request).await
        };
        match tokio::time::timeout(within, asked).await {
            Ok(answer) => answer.map_err(|error| unanswered(subject, within, &error)),
            Err(_) => Err(Unanswered::TimedOut(within)),
        }
    }

    /// Waits for a connection. What is asked without one, the library keeps until there is one: in an outage, each
    /// repetition of a message would be there once more.
    pub(super) async fn connected(&self) {
        while !self.is_connected() {
            tokio::time::sleep(LOOK_EVERY).await;
        }
    }
}

fn unanswered(subject: &str, within: Duration, error: &RequestError) -> Unanswered {
    match error.kind() {
        RequestErrorKind::NoResponders => Unanswered::NoResponders(subject.to_owned()),
        RequestErrorKind::TimedOut => Unanswered::TimedOut(within),
        _ => Unanswered::Failed(error.to_string()),
    }
}
