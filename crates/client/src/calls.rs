//! How calls are made: to one server, or to one of several until it is gone.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio_stream::{Stream, StreamExt};
use tonic::Request;
use tonic::transport::Channel;

use super::answers::Answers;
use super::connection::Connection;
use super::error::ClientError;
use super::servers::{Servers, Several, Tried};
use super::told_revisions::{Question, ToldRevisions, Versioned};
use mrol_map::map::MapName;
use mrol_service::Reason;

/// Reason of a refusal by a server that does not hold the map; another one does.
const MAP_ELSEWHERE: &str = "map_elsewhere";

/// How long before its deadline a call counts as one that ran out of time: whoever waits for it as long may give up a
/// moment before.
const DEADLINE_MARGIN: Duration = Duration::from_millis(10);

/// Makes calls.
#[derive(Debug, Clone)]
pub(super) struct Calls {
    servers: Servers,
    /// What the servers said last; of use where there are several.
    told: Arc<ToldRevisions>,
    timeout: Option<Duration>,
}

/// Whether a call may be sent to another server after it failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Repeat {
    /// It changes nothing.
    Always,
    /// It has an id by which the servers know it.
    WithId,
    /// Not once it was sent: it might be done twice.
    UnlessSent,
}

/// What to do after a call failed.
enum Next {
    /// Its error is the answer.
    End,
    /// Another server is asked, and later calls go there, too.
    Leave,
    /// Another server is asked about this alone.
    Elsewhere,
}

impl Repeat {
    fn after(self, error: &ClientError) -> Next {
        let said = |reason: Reason| error.reason() == Some(reason.as_str());
        match error {
            ClientError::Unreachable { .. } => Next::Leave,
            ClientError::Lost { .. } if self != Self::UnlessSent => Next::Leave,
            ClientError::Refused { .. } if said(Reason::Draining) || said(Reason::Starting) => Next::Leave,
            ClientError::Refused { .. } if error.reason() == Some(MAP_ELSEWHERE) => Next::Elsewhere,
            // Another server may be farther, and later questions need not wait for this one.
            ClientError::Refused { .. } if said(Reason::RevisionNotReached) => Next::Leave,
            _ => Next::End,
        }
    }
}

impl Calls {
    pub(super) fn new(servers: Servers) -> Self {
        Self { servers, told: Arc::default(), timeout: None }
    }

    /// The same, with a deadline for each call, or without one, as streams are.
    pub(super) fn with_timeout(&self, timeout: Option<Duration>) -> Self {
        Self { timeout, ..self.clone() }
    }

    /// The channel to the server in use.
    pub(super) fn channel(&self) -> Channel {
        self.servers.channel()
    }

    /// True where there are several servers.
    pub(super) fn has_several(&self) -> bool {
        matches!(self.servers, Servers::Several(_))
    }

    /// Asks what changes nothing.
    pub(super) async fn ask<M: Clone, T, F, Fut>(&self, message: M, send: F) -> Result<T, ClientError>
    where
        F: Fn(Connection, Request<M>) -> Fut,
        Fut: Future<Output = Result<T, ClientError>>,
    {
        self.send(message, self.until(), Repeat::Always, &send).await
    }

    /// Asks something about a map that changes nothing, and notes the version that is answered.
    pub(super) async fn ask_about<M: Clone, T: Versioned, F, Fut>(
        &self,
        map: &MapName,
        message: M,
        send: F,
    ) -> Result<T, ClientError>
    where
        F: Fn(Connection, Request<M>) -> Fut,
        Fut: Future<Output = Result<T, ClientError>>,
    {
        let answer = self.send(message, self.until(), Repeat::Always, &send).await;
        self.noted(map, answer)
    }

    /// Asks a question that can wait for a revision: of several servers, for the last one that any of them told.
    pub(super) async fn question<M: Clone + Question, T: Versioned, F, Fut>(
        &self,
        map: &MapName,
        mut message: M,
        send: F,
    ) -> Result<T, ClientError>
    where
        F: Fn(Connection, Request<M>) -> Fut,
        Fut: Future<Output = Result<T, ClientError>>,
    {
        let until = self.until();
        let Some(floor) = self.told.floor(map).filter(|_| self.has_several()) else {
            return self.noted(map, self.send(message, until, Repeat::Always, &send).await);
        };
        let without = message.clone();
        let is_ours = floor.raise(&mut message);
        let answer = self.send(message, until, Repeat::Always, &send).await;
        let is_replaced = |error: &ClientError| error.reason() == Some(Reason::MapReplaced.as_str());
        if !(is_ours && answer.as_ref().is_err_and(is_replaced)) {
            return self.noted(map, answer);
        }
        // The caller did not ask for that map: the name is that of another one now.
        self.told.forget(map, floor);
        self.noted(map, self.send(without, until, Repeat::Always, &send).await)
    }

    /// Changes a map. One `with_id` is sent to another server even if it is not known whether it was done.
    pub(super) async fn change<M: Clone, T: Versioned, F, Fut>(
        &self,
        map: &MapName,
        with_id: bool,
        message: M,
        send: F,
    ) -> Result<T, ClientError>
    where
        F: Fn(Connection, Request<M>) -> Fut,
        Fut: Future<Output = Result<T, ClientError>>,
    {
        let repeat = if with_id { Repeat::WithId } else { Repeat::UnlessSent };
        let answer = self.send(message, self.until(), repeat, &send).await;
        self.noted(map, answer)
    }

    /// Changes what has no version behind it, and no id.
    pub(super) async fn change_of_none<M: Clone, T, F, Fut>(
        &self,
        message: M,
        send: F,
    ) -> Result<T, ClientError>
    where
        F: Fn(Connection, Request<M>) -> Fut,
        Fut: Future<Output = Result<T, ClientError>>,
    {
        self.send(message, self.until(), Repeat::UnlessSent, &send).await
    }

    /// The connection for a stream of requests, which cannot be sent again: of several servers, one to a server that is
    /// there.
    ///
    /// # Errors
    /// When none is.
    pub(super) async fn connection_of_stream(&self) -> Result<Connection, ClientError> {
        match &self.servers {
            Servers::One(connection) => Ok(connection.clone()),
            Servers::Several(several) => several.own_connection().await,
        }
    }

    /// The requests of a stream of questions about `map`: of several servers, the first of them waits for the last
    /// revision that was told. The others are answered by the same server, which does not go back.
    pub(super) fn requests<Q: Question>(
        &self,
        map: &MapName,
        requests: impl Stream<Item = Q> + Send + 'static,
    ) -> impl Stream<Item = Q> + Send + 'static {
        let mut floor = self.told.floor(map).filter(|_| self.has_several());
        requests.map(move |mut request| {
            if let Some(floor) = floor.take() {
                floor.raise(&mut request);
            }
            request
        })
    }

    /// The answers of a stream of requests about `map`, whose versions are noted.
    pub(super) fn answers<T: Versioned + 'static>(&self, map: &MapName, answers: Answers<T>) -> Answers<T> {
        if !self.has_several() {
            return answers;
        }
        let (told, map, floor) = (Arc::clone(&self.told), map.clone(), self.told.floor(map));
        Answers::new(answers.map(move |answer| {
            match &answer {
                Ok(answer) => told.note(&map, answer.version()),
                Err(error) if error.reason() == Some(Reason::MapReplaced.as_str()) => {
                    floor.into_iter().for_each(|floor| told.forget(&map, floor));
                }
                Err(_) => {}
            }
            answer
        }))
    }

    fn until(&self) -> Option<Instant> {
        self.timeout.and_then(|timeout| Instant::now().checked_add(timeout))
    }

    fn noted<T: Versioned>(&self, map: &MapName, answer: Result<T, ClientError>) -> Result<T, ClientError> {
        let answer = answer?;
        if self.has_several() {
            self.told.note(map, answer.version());
        }
        Ok(answer)
    }

    async fn send<M: Clone, T, F, Fut>(
        &self,
        message: M,
        until: Option<Instant>,
        repeat: Repeat,
        send: &F,
    ) -> Result<T, ClientError>
    where
        F: Fn(Connection, Request<M>) -> Fut,
        Fut: Future<Output = Result<T, ClientError>>,
    {
        match &self.servers {
            Servers::One(connection) => send(connection.clone(), request(message, self.timeout)).await,
            Servers::Several(several) => send_to(several, message, until, repeat, send).await,
        }
    }
}

/// Sends a message to one server after the other, until one answers, its failure is final, or the time is up.
async fn send_to<M: Clone, T, F, Fut>(
    several: &Several,
    message: M,
    until: Option<Instant>,
    repeat: Repeat,
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

fn request<M>(message: M, timeout: Option<Duration>) -> Request<M> {
    let mut request = Request::new(message);
    if let Some(timeout) = timeout {
        request.set_timeout(timeout);
    }
    request
}

#[cfg(test)]
mod tests {
    use tonic::Code;

    use super::*;

    fn refused(reason: &str) -> ClientError {
        let (code, reason) = (Code::Unavailable, Some(reason.to_owned()));
        ClientError::Refused { code, reason, message: String::new(), retry_after: None }
    }

    #[test]
    fn only_a_refusal_that_another_server_may_not_give_is_taken_elsewhere() {
        let next = |error: &ClientError| match Repeat::UnlessSent.after(error) {
            Next::End => "end",
            Next::Leave => "leave",
            Next::Elsewhere => "elsewhere",
        };
        for reason in ["draining", "starting"] {
            assert_eq!(next(&refused(reason)), "leave", "{reason}");
        }
        assert_eq!(next(&refused("revision_not_reached")), "leave");
        assert_eq!(next(&refused(MAP_ELSEWHERE)), "elsewhere");
        for reason in ["overloaded", "map_not_found", "guess_required", "outcome_unknown", "key_unknown"] {
            assert_eq!(next(&refused(reason)), "end", "{reason}");
        }
        assert_eq!(next(&ClientError::Foreign { url: String::new(), cause: String::new() }), "end");
    }

    #[test]
    fn what_was_sent_is_sent_again_only_where_it_is_known_by_an_id_or_changes_nothing() {
        let (lost, unreachable) = (
            ClientError::Lost { url: String::new(), cause: String::new() },
            ClientError::Unreachable { url: String::new(), cause: String::new() },
        );
        assert!(matches!(Repeat::UnlessSent.after(&lost), Next::End));
        assert!(matches!(Repeat::Always.after(&lost), Next::Leave));
        assert!(matches!(Repeat::UnlessSent.after(&unreachable), Next::Leave));
    }
}
