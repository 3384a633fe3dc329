//! How one call is sent: to a server that was named, or to one of several until it is gone.

use std::time::{Duration, Instant};

use tonic::Request;

use super::connection::Connection;
use super::elsewhere::Elsewhere;
use super::error::ClientError;
use super::repeat::{Next, Repeat};
use super::servers::{Several, Tried};

/// How long before its deadline a call counts as one that ran out of time: whoever waits for it as long may give up a
/// moment before.
const DEADLINE_MARGIN: Duration = Duration::from_millis(10);

/// Sends a message to a server that another one named.
pub(super) async fn send_there<M, T, F, Fut>(
    elsewhere: &Elsewhere,
    address: &str,
    message: M,
    until: Option<Instant>,
    send: &F,
) -> Result<T, ClientError>
where
    F: Fn(Connection, Request<M>) -> Fut,
    Fut: Future<Output = Result<T, ClientError>>,
{
    let connection = elsewhere.connection(address, until).await?;
    let left = until.map(|until| until.saturating_duration_since(Instant::now()));
    let mut waiting = Waiting { connection: &connection, until };
    let answer = send(connection.clone(), request(message, left)).await;
    waiting.until = None;
    answer
}

/// Sends a message to one server after the other, until one answers, its failure is final or by `is_sent_on` names
/// another server, or the time is up.
pub(super) async fn send_to<M: Clone, T, F, Fut>(
    several: &Several,
    message: M,
    until: Option<Instant>,
    repeat: Repeat,
    is_sent_on: impl Fn(&ClientError) -> bool,
    send: &F,
) -> Result<T, ClientError>
where
    F: Fn(Connection, Request<M>) -> Fut,
    Fut: Future<Output = Result<T, ClientError>>,
{
    let mut tried = Tried::default();
    let mut lost = None;
    while let Some((place, connection)) = several.connection(&mut tried, until).await {
        let left = until.map(|until| until.saturating_duration_since(Instant::now()));
        let mut waiting = Waiting { connection: &connection, until };
        let answer = send(connection.clone(), request(message.clone(), left)).await;
        waiting.until = None;
        let error = match answer {
            Ok(answer) => return Ok(answer),
            Err(error) => error,
        };
        match repeat.after(&error) {
            // The server that it was sent to before may have done it: that this one refuses it does not say.
            Next::End => return Err(lost.unwrap_or(error)),
            Next::Leave => connection.give_up(),
            Next::Elsewhere if is_sent_on(&error) => return Err(error),
            Next::Elsewhere => {}
        }
        // A server whose connection was lost may be there again, after the others were asked.
        if matches!(error, ClientError::Refused { .. }) {
            tried.exclude(place);
        }
        if repeat == Repeat::WithId && matches!(error, ClientError::Lost { .. }) {
            lost = lost.or_else(|| Some(error.clone()));
        }
        tried.note(error);
    }
    Err(lost.unwrap_or_else(|| several.failure(tried)))
}

/// A call under way. Where it is dropped when its time is up, the server may hang: later calls go to another.
struct Waiting<'c> {
    connection: &'c Connection,
    until: Option<Instant>,
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        if self.until.is_some_and(|until| until <= Instant::now() + DEADLINE_MARGIN) {
            self.connection.give_up();
        }
    }
}

/// A message as a request, which may take so long.
pub(super) fn request<M>(message: M, timeout: Option<Duration>) -> Request<M> {
    let mut request = Request::new(message);
    if let Some(timeout) = timeout {
        request.set_timeout(timeout);
    }
    request
}
