//! Who gets in, and how much of the server's memory may lie in requests and answers at once.
//!
//! ```text
//! rate of the caller -> the body arrives -> requests_max -> work -> the answer is sent
//!                       body_bytes_max                              body_bytes_max
//! ```
//!
//! A request counts as one in work when its body has arrived, so that nobody keeps others out by sending slowly. Bodies
//! count by the bytes that have come, not by what was declared; where there is no room for more, the one that has been
//! silent for longest gives way. Probes pass by all of this.

mod arrival;
mod bodies;
mod held_body;
mod limits;
mod metered_body;
mod quota;
mod rate;

pub use arrival::{Arrival, HangUp};
pub use bodies::{BODY_SILENT, Charge};
pub use limits::AdmissionLimits;
pub use rate::{Asking, Peer};

use std::sync::Arc;

use axum::body::Body;
use axum::extract::Request;
use axum::http::Method;
use axum::response::Response;

use crate::access::Operation;
use crate::lifecycle::Lifecycle;
use crate::service::ServiceError;
use bodies::Bodies;
use held_body::HeldBody;
use metered_body::MeteredBody;
use quota::Quota;
use rate::Rates;

/// Lets requests in, or sheds them. A clone is another handle on the same counts.
#[derive(Debug, Clone)]
pub struct Admission(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    lifecycle: Lifecycle,
    rates: Option<Rates>,
    streams: Quota,
    bodies: Bodies,
}

/// How much of what is limited is in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InUse {
    /// Requests in work.
    pub requests: usize,
    /// Requests whose bodies are arriving.
    pub arriving: usize,
    /// Streams.
    pub streams: usize,
    /// Bytes of bodies and answers.
    pub bytes: usize,
}

impl Admission {
    /// Nobody is in.
    pub fn new(limits: &AdmissionLimits, lifecycle: Lifecycle) -> Self {
        Self(Arc::new(Inner {
            lifecycle,
            rates: Rates::new(limits),
            streams: Quota::new("streams_max", limits.streams_max),
            bodies: Bodies::new(limits),
        }))
    }

    /// Lets a request in and answers it by `handle`. It counts until its answer is sent.
    ///
    /// # Errors
    /// `ResourceExhausted` with the name of the limit that it would exceed; `Unavailable` when the server is going
    /// down; `DeadlineExceeded` when its body does not come.
    pub async fn answer<F>(
        &self,
        operation: Operation,
        request: Request,
        handle: impl FnOnce(Request) -> F,
    ) -> Result<Response, ServiceError>
    where
        F: Future<Output = Result<Response, ServiceError>>,
    {
        let place = operation.is_stream().then(|| self.0.streams.take()).transpose()?;
        if operation.is_probe() {
            let response = handle(request).await?;
            return Ok(response.map(|body| Body::new(HeldBody::new(body, None, place))));
        }
        let asking = Asking::of(request.extensions());
        self.check_rate(&asking)?;
        let own_place = asking.begin()?;
        let hang_up = request.extensions().get().cloned();
        let arrival = self.0.bodies.begin(operation.is_stream(), hang_up)?;
        let request = Self::metered(request, &arrival)?;
        let answered = self.0.lifecycle.admit(handle(request)).await?;
        let response = arrival.refusal().map_or(answered, Err)?;
        // Streams are told that the server is going down; other answers are waited for.
        let held = (!operation.is_stream()).then(|| self.0.lifecycle.hold());
        if held.is_some() {
            drop(arrival.take());
        }
        Ok(response.map(|body| Body::new(HeldBody::new(body, Some(arrival), (place, own_place, held)))))
    }

    /// Lets the next message of a stream in.
    ///
    /// # Errors
    /// `ResourceExhausted` when the caller asks too often.
    pub fn check_rate(&self, asking: &Asking) -> Result<(), ServiceError> {
        asking.check_rate(self.0.rates.as_ref())
    }

    /// Whether the server is going down.
    pub fn lifecycle(&self) -> &Lifecycle {
        &self.0.lifecycle
    }

    /// Memory that an answer takes until it is sent.
    ///
    /// # Errors
    /// `ResourceExhausted` when there is no room.
    pub fn keep(&self, bytes: usize) -> Result<Charge, ServiceError> {
        self.0.bodies.charge(bytes)
    }

    /// Ends what has been silent for too long, and forgets callers who have not come for a while; to be called now and
    /// then.
    pub fn sweep(&self) {
        self.0.bodies.end_silent();
        if let Some(rates) = &self.0.rates {
            rates.forget_old();
        }
    }

    /// What is in use now.
    pub fn in_use(&self) -> InUse {
        InUse { streams: self.0.streams.taken(), ..self.0.bodies.in_use() }
    }

    /// The request with a body that is counted as it arrives; a handler finds the [`Arrival`] among its extensions.
    fn metered(mut request: Request, arrival: &Arrival) -> Result<Request, ServiceError> {
        request.extensions_mut().insert(arrival.clone());
        // Of other requests nobody reads the body to its end.
        let body_is_read = matches!(*request.method(), Method::POST | Method::PUT);
        if !body_is_read {
            arrival.complete()?;
        }
        Ok(request.map(|body| Body::new(MeteredBody::new(body, arrival.clone()))))
    }
}
