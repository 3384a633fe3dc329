//! One body on its way in.

use std::sync::Arc;
use std::time::Duration;

use axum::http::Extensions;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::bodies::{Bodies, Charge};
use super::quota::{Quota, Taken};
use crate::service::{ErrorCode, ServiceError};

/// A body that was silent for less than this gives way to nobody: it may be on a slow path.
const GRACE: Duration = Duration::from_secs(1);

/// What is known of a body.
#[derive(Debug)]
pub(super) struct Body {
    is_stream: bool,
    /// That are in memory.
    bytes: usize,
    /// When the last of them came.
    heard: Instant,
    state: State,
    ended: CancellationToken,
}

#[derive(Debug)]
enum State {
    Arriving,
    /// It counts as a request in work.
    Complete {
        _place: Taken,
    },
    /// It was ended before it was complete.
    Ended(ServiceError),
}

impl Body {
    pub(super) fn new(is_stream: bool, ended: CancellationToken) -> Self {
        Self { is_stream, bytes: 0, heard: Instant::now(), state: State::Arriving, ended }
    }

    /// True of a request that has not come in full.
    pub(super) fn is_arriving(&self) -> bool {
        !self.is_stream && matches!(self.state, State::Arriving)
    }

    /// For how long nothing has come, where more must: a stream may be silent between two messages.
    pub(super) fn silence(&self) -> Option<Duration> {
        let awaited = matches!(self.state, State::Arriving) && (!self.is_stream || self.bytes > 0);
        awaited.then(|| self.heard.elapsed())
    }

    /// The same where that is long enough for others to go first.
    pub(super) fn gives_way_after(&self) -> Option<Duration> {
        self.silence().filter(|silence| *silence >= GRACE)
    }

    pub(super) fn refusal(&self) -> Option<&ServiceError> {
        match &self.state {
            State::Ended(refusal) => Some(refusal),
            State::Arriving | State::Complete { .. } => None,
        }
    }

    /// More has come, and there is `room` for it or not.
    pub(super) fn add(&mut self, bytes: usize, room: Result<(), ServiceError>) -> Result<(), ServiceError> {
        if let State::Ended(refusal) = &self.state {
            return Err(refusal.clone());
        }
        room.inspect_err(|refusal| self.state = State::Ended(refusal.clone()))?;
        self.heard = Instant::now();
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
            self.state = State::Complete { _place: place };
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
pub struct Arrival(Arc<Held>);

#[derive(Debug)]
struct Held {
    bodies: Bodies,
    number: u64,
    ended: CancellationToken,
}

impl Arrival {
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

    /// Its bytes in memory, which are given back when the charge is dropped: of a message that was read from it.
    pub fn take(&self) -> Charge {
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
