//! One body on its way in.

use std::sync::Arc;
use std::time::Duration;

use axum::http::Extensions;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::bodies::{Bodies, MemoryPermit};
use super::quota::{Quota, Taken};
use crate::service::{ErrorCode, ServiceError};

/// What is known of a body.
#[derive(Debug)]
pub(super) struct Body {
    is_stream: bool,
    /// That are in memory.
    bytes: usize,
    /// Up to when they came in time: each accounts for a part of a second, and none for time to come.
    in_time: Instant,
    /// Since when nobody waits for more: meanwhile it is not the client who is silent.
    left_alone: Option<Instant>,
    state: State,
    ended: CancellationToken,
    hang_up: Option<CloseConnection>,
}

/// Closes the connection that a request came by; to be found among its extensions.
#[derive(Debug, Clone)]
pub struct CloseConnection(pub CancellationToken);

#[derive(Debug)]
enum State {
    Arriving,
    /// It counts as a request in work.
    Complete {
        _place: Taken,
        /// Since when its answer waits to be read.
        unread: Option<Instant>,
    },
    /// It was ended before it was complete.
    Ended(ServiceError),
}

impl Body {
    pub(super) fn new(is_stream: bool, ended: CancellationToken, hang_up: Option<CloseConnection>) -> Self {
        let (now, state) = (Instant::now(), State::Arriving);
        Self { is_stream, bytes: 0, in_time: now, left_alone: Some(now), state, ended, hang_up }
    }

    /// True of a request that has not come in full.
    pub(super) fn is_arriving(&self) -> bool {
        !self.is_stream && matches!(self.state, State::Arriving)
    }

    /// For how long nothing has come, or so much too little, where more must: a stream may be silent between two
    /// messages.
    pub(super) fn silence(&self) -> Option<Duration> {
        let arriving = matches!(self.state, State::Arriving) && (!self.is_stream || self.bytes > 0);
        (arriving && self.left_alone.is_none()).then(|| self.in_time.elapsed())
    }

    /// For how long the answer to it has waited to be read.
    pub(super) fn unread_for(&self) -> Option<Duration> {
        match self.state {
            State::Complete { unread: Some(since), .. } => Some(since.elapsed()),
            _ => None,
        }
    }

    /// Its answer waits to be read, or is being read.
    pub(super) fn set_unread(&mut self, waits: bool) {
        if let State::Complete { unread, .. } = &mut self.state {
            *unread = waits.then(Instant::now);
        }
    }

    /// Closes the connection that it came by.
    pub(super) fn hang_up(&self) {
        if let Some(CloseConnection(connection)) = &self.hang_up {
            connection.cancel();
        }
    }

    pub(super) fn refusal(&self) -> Option<&ServiceError> {
        match &self.state {
            State::Ended(refusal) => Some(refusal),
            State::Arriving | State::Complete { .. } => None,
        }
    }

    /// Somebody waits for more.
    pub(super) fn await_more(&mut self) {
        if let Some(since) = self.left_alone.take() {
            self.in_time += since.elapsed();
        }
    }

    /// More has come, which accounts for `time`, and there is `room` for it or not.
    pub(super) fn add(
        &mut self,
        bytes: usize,
        time: Duration,
        room: Result<(), ServiceError>,
    ) -> Result<(), ServiceError> {
        if let State::Ended(refusal) = &self.state {
            return Err(refusal.clone());
        }
        room.inspect_err(|refusal| self.state = State::Ended(refusal.clone()))?;
        let now = Instant::now();
        let begins_message = self.is_stream && self.bytes == 0;
        let in_time = self.in_time.checked_add(time).filter(|_| !begins_message);
        self.in_time = in_time.map_or(now, |in_time| in_time.min(now));
        self.left_alone = Some(now);
        self.bytes += bytes;
        Ok(())
    }

    /// All has come. A stream goes on.
    pub(super) fn complete(&mut self, requests: &Quota) -> Result<(), ServiceError> {
        if let State::Ended(refusal) = &self.state {
            return Err(refusal.clone());
        }
        if self.is_arriving() {
            let place = requests.take();
            let place = place.inspect_err(|refusal| self.state = State::Ended(refusal.clone()))?;
            self.state = State::Complete { _place: place, unread: None };
        }
        Ok(())
    }

    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn take_bytes(&mut self) -> usize {
        std::mem::take(&mut self.bytes)
    }

    /// Ends it: it keeps no memory.
    pub(super) fn end(&mut self, refusal: ServiceError) {
        self.state = State::Ended(refusal);
        self.bytes = 0;
        self.ended.cancel();
    }
}

/// A handle on a body, which is forgotten with the last of them.
#[derive(Debug, Clone)]
pub struct InboundBody(Arc<Held>);

#[derive(Debug)]
struct Held {
    bodies: Bodies,
    number: u64,
    ended: CancellationToken,
}

impl InboundBody {
    pub(super) fn new(bodies: Bodies, number: u64, ended: CancellationToken) -> Self {
        Self(Arc::new(Held { bodies, number, ended }))
    }

    /// That of a request, which admission has put among its extensions.
    ///
    /// # Errors
    /// `Internal` where the request was never admitted.
    pub fn of(request: &Extensions) -> Result<&Self, ServiceError> {
        request.get().ok_or_else(|| {
            let message = "the request was not admitted: a defect of the server";
            ServiceError::new(ErrorCode::Internal, "not_admitted", message)
        })
    }

    /// More of it has come.
    ///
    /// # Errors
    /// When there is no room for it, or it was ended.
    pub fn add(&self, bytes: usize) -> Result<(), ServiceError> {
        self.0.bodies.add(self.0.number, bytes)
    }

    /// Somebody waits for more of it.
    pub(super) fn await_more(&self) {
        self.0.bodies.await_more(self.0.number);
    }

    /// What was made of it takes `bytes`.
    ///
    /// # Errors
    /// When there is no room for more than had come.
    pub fn at_least(&self, bytes: usize) -> Result<(), ServiceError> {
        self.0.bodies.at_least(self.0.number, bytes)
    }

    /// All of it has come: from now on it counts as a request in work.
    ///
    /// # Errors
    /// When as many are in work as may be.
    pub(super) fn complete(&self) -> Result<(), ServiceError> {
        self.0.bodies.complete(self.0.number)
    }

    /// Its answer waits for its client to read it, or for more of it.
    pub(super) fn answer_waits(&self) {
        self.0.bodies.set_unread(self.0.number, true);
    }

    /// Its client reads on in the answer.
    pub(super) fn answer_is_read(&self) {
        self.0.bodies.set_unread(self.0.number, false);
    }

    /// Its bytes in memory, which are given back when the charge is dropped: of a message that was read from it.
    pub fn take(&self) -> MemoryPermit {
        self.0.bodies.take(self.0.number)
    }

    /// Why it was ended, if it was.
    pub fn refusal(&self) -> Option<ServiceError> {
        self.0.bodies.refusal(self.0.number)
    }

    /// Is cancelled when it is ended.
    pub(super) fn ended(&self) -> CancellationToken {
        self.0.ended.clone()
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.bodies.forget(self.number);
    }
}
