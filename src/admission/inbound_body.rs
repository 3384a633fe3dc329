//! A request's body on its way in.

use std::sync::Arc;

use axum::http::Extensions;
use tokio_util::sync::CancellationToken;

use super::bodies::{Bodies, MemoryPermit};
use super::body_state::CloseConnection;
use mrol_service::{Reason, ServiceError};

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
    /// A body begins to arrive.
    ///
    /// # Errors
    /// When as many requests are arriving as may be, and none was silent.
    pub(super) fn begin(
        bodies: &Bodies,
        is_stream: bool,
        hang_up: Option<CloseConnection>,
    ) -> Result<Self, ServiceError> {
        let (number, ended) = bodies.begin(is_stream, hang_up)?;
        Ok(Self(Arc::new(Held { bodies: bodies.clone(), number, ended })))
    }

    /// The body of a request, which admission has put among its extensions.
    ///
    /// # Errors
    /// `Internal` where the request was never admitted.
    pub fn of(request: &Extensions) -> Result<&Self, ServiceError> {
        request.get().ok_or_else(|| {
            let message = "the request was not admitted: a defect of the server";
            ServiceError::new(Reason::NotAdmitted, message)
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

    /// The answer waits: for its client to read it, or for more of the answer.
    pub(super) fn answer_waits(&self) {
        self.0.bodies.set_unread(self.0.number, true);
    }

    /// The client reads on in the answer.
    pub(super) fn answer_is_read(&self) {
        self.0.bodies.set_unread(self.0.number, false);
    }

    /// Takes over the body's bytes in memory for a message that was read from it; they are given back when the permit
    /// is dropped.
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
