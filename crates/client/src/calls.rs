//! How calls are made: to one server, or to one of several until it is gone, and on to those that they name.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio_stream::{Stream, StreamExt};
use tonic::Request;
use tonic::transport::Channel;

use super::answers::Answers;
use super::connection::Connection;
use super::elsewhere::{Elsewhere, HOPS_MAX};
use super::error::ClientError;
use super::repeat::{Next, Repeat};
use super::sending::{request, send_there, send_to};
use super::servers::Servers;
use super::told_revisions::{Question, ToldRevisions, Versioned};
use mrol_map::map::MapName;
use mrol_service::Reason;

/// Makes calls.
#[derive(Debug, Clone)]
pub(super) struct Calls {
    servers: Servers,
    /// The servers that they name; none of a client that is sent on nowhere.
    elsewhere: Option<Arc<Elsewhere>>,
    /// What the servers said last; of use where there are several.
    told: Arc<ToldRevisions>,
    timeout: Option<Duration>,
}

impl Calls {
    /// Calls to these servers, which are sent on to no others than those of `elsewhere`.
    pub(super) fn new(servers: Servers, elsewhere: Option<Elsewhere>) -> Self {
        Self { servers, elsewhere: elsewhere.map(Arc::new), told: Arc::default(), timeout: None }
    }

    /// The same, which are sent on nowhere.
    pub(super) fn not_sent_on(&self) -> Self {
        Self { elsewhere: None, ..self.clone() }
    }

    /// The same, with a deadline for each call, or without one, as streams are.
    pub(super) fn with_timeout(&self, timeout: Option<Duration>) -> Self {
        Self { timeout, ..self.clone() }
    }

    /// The channel to the server in use.
    pub(super) fn channel(&self) -> Channel {
        self.servers.channel()
    }

    /// True where there are several servers, of this client or since one named others.
    pub(super) fn has_several(&self) -> bool {
        matches!(self.servers, Servers::Several(_)) || self.elsewhere.as_ref().is_some_and(|it| it.is_used())
    }

    /// Asks what changes nothing: about `map`, or about no map of its own.
    pub(super) async fn ask<M: Clone, T, F, Fut>(
        &self,
        map: Option<&MapName>,
        message: M,
        send: F,
    ) -> Result<T, ClientError>
    where
        F: Fn(Connection, Request<M>) -> Fut,
        Fut: Future<Output = Result<T, ClientError>>,
    {
        self.send(map, message, self.until(), Repeat::Always, &send).await
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
        let answer = self.send(Some(map), message, self.until(), Repeat::Always, &send).await;
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
            return self.noted(map, self.send(Some(map), message, until, Repeat::Always, &send).await);
        };
        let without = message.clone();
        let is_ours = floor.raise(&mut message);
        let answer = self.send(Some(map), message, until, Repeat::Always, &send).await;
        let is_replaced = |error: &ClientError| error.reason() == Some(Reason::MapReplaced.as_str());
        if !(is_ours && answer.as_ref().is_err_and(is_replaced)) {
            return self.noted(map, answer);
        }
        // The caller did not ask for that map: the name is that of another one now.
        self.told.forget(map, floor);
        self.noted(map, self.send(Some(map), without, until, Repeat::Always, &send).await)
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
        let answer = self.send(Some(map), message, self.until(), repeat, &send).await;
        self.noted(map, answer)
    }

    /// Changes what has no version behind it, and no id.
    pub(super) async fn change_of_none<M: Clone, T, F, Fut>(
        &self,
        map: &MapName,
        message: M,
        send: F,
    ) -> Result<T, ClientError>
    where
        F: Fn(Connection, Request<M>) -> Fut,
        Fut: Future<Output = Result<T, ClientError>>,
    {
        self.send(Some(map), message, self.until(), Repeat::UnlessSent, &send).await
    }

    /// The connection for a stream of requests about `map`, which cannot be sent again: to the server that holds the
    /// map, where one was named before; of several servers, to one that is there.
    ///
    /// # Errors
    /// When none is.
    pub(super) async fn connection_of_stream(&self, map: &MapName) -> Result<Connection, ClientError> {
        if let Some(elsewhere) = &self.elsewhere
            && let Some(place) = elsewhere.place(map)
        {
            match elsewhere.connection(&place, self.until()).await {
                Ok(connection) => return Ok(connection),
                Err(_) => elsewhere.forget(map),
            }
        }
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

    /// The answers of a stream of requests about `map`, whose versions are noted; and where the map is, for the next
    /// stream, where they are refused by a server that does not hold it.
    ///
    /// # Errors
    /// When the stream was not opened.
    pub(super) fn answers<T: Versioned + 'static>(
        &self,
        map: &MapName,
        opened: Result<Answers<T>, ClientError>,
    ) -> Result<Answers<T>, ClientError> {
        let answers = opened.inspect_err(|error| self.note_place(map, error))?;
        let (calls, map, floor) = (self.clone(), map.clone(), self.told.floor(map));
        Ok(Answers::new(answers.map(move |answer| {
            match &answer {
                Ok(answer) if calls.has_several() => calls.told.note(&map, answer.version()),
                Ok(_) => {}
                Err(error) if error.reason() == Some(Reason::MapReplaced.as_str()) => {
                    floor.into_iter().for_each(|floor| calls.told.forget(&map, floor));
                }
                Err(error) => calls.note_place(&map, error),
            }
            answer
        })))
    }

    /// Notes where a map is, where a refusal names that.
    fn note_place(&self, map: &MapName, error: &ClientError) {
        if let Some(elsewhere) = &self.elsewhere
            && let Some(address) = elsewhere.named(error).next()
        {
            elsewhere.note(map, address);
        }
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

    /// Sends a message: about a map of which another server was named before, to that one, and otherwise to this
    /// client's own, and on to those that they name.
    async fn send<M: Clone, T, F, Fut>(
        &self,
        map: Option<&MapName>,
        message: M,
        until: Option<Instant>,
        repeat: Repeat,
        send: &F,
    ) -> Result<T, ClientError>
    where
        F: Fn(Connection, Request<M>) -> Fut,
        Fut: Future<Output = Result<T, ClientError>>,
    {
        let Some((elsewhere, map)) = self.elsewhere.as_deref().zip(map) else {
            return self.send_to_own(message, until, repeat, send).await;
        };
        let mut lost = None;
        if let Some(place) = elsewhere.place(map) {
            let error = match send_there(elsewhere, &place, message.clone(), until, send).await {
                Ok(answer) => return Ok(answer),
                Err(error) => error,
            };
            if matches!(repeat.after_sent_on(&error), Next::End) {
                return Err(error);
            }
            elsewhere.forget(map);
            lost = Some(error).filter(|error| matches!(error, ClientError::Lost { .. }));
        }
        let mut answer = self.send_to_own(message.clone(), until, repeat, send).await;
        for _ in 0..HOPS_MAX {
            let named: Vec<String> = match &answer {
                Ok(_) => Vec::new(),
                Err(error) => elsewhere.named(error).map(str::to_owned).collect(),
            };
            // It has just left the map to others, whom it did not know yet.
            if answer.as_ref().is_err_and(|error| matches!(repeat.after(error), Next::Elsewhere))
                && named.is_empty()
            {
                answer = self.send_to_own(message.clone(), until, repeat, send).await;
            }
            for address in named {
                answer = send_there(elsewhere, &address, message.clone(), until, send).await;
                if let Err(error @ ClientError::Lost { .. }) = &answer {
                    lost = lost.or_else(|| Some(error.clone()));
                }
                let next = answer.as_ref().err().map_or(Next::End, |error| repeat.after_sent_on(error));
                match next {
                    Next::End => {
                        elsewhere.note(map, &address);
                        break;
                    }
                    Next::Leave => {}
                    Next::Elsewhere => break,
                }
            }
        }
        // The server that it was sent to before may have done it: that another refuses it does not say.
        let lost = lost.filter(|_| repeat == Repeat::WithId);
        answer.map_err(|error| lost.unwrap_or(error))
    }

    /// Sends a message to this client's own servers.
    async fn send_to_own<M: Clone, T, F, Fut>(
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
        let is_sent_on = |error: &ClientError| {
            self.elsewhere.as_ref().is_some_and(|elsewhere| elsewhere.named(error).next().is_some())
        };
        match &self.servers {
            Servers::One(connection) => send(connection.clone(), request(message, self.timeout)).await,
            Servers::Several(several) => send_to(several, message, until, repeat, is_sent_on, send).await,
        }
    }
}
