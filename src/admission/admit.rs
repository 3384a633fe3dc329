//! Admission: what is done at once is bounded, and counted.

use super::answer_body::Endings;
use super::bodies::MemoryPermit;
use super::inbound_body::InboundBody;
use super::lifecycle::Lifecycle;
use super::lifecycle::draining;
use super::of_connection::OfConnection;
use super::rate::RateLimitKey;
use std::num::NonZeroU32;
use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, HttpBody};
use axum::extract::Request;
use axum::http::Method;
use axum::response::Response;

use super::answer_body::AnswerBody;
use super::bodies::Bodies;
use super::metered_body::MeteredBody;
use super::probes::Probes;
use super::quota::Quota;
use super::rate::Rates;
use super::shares::Shares;
use crate::access::{Authorized, Operation};
use crate::telemetry::InUse;
use mrol_service::{Limits, ServiceError};

/// Lets requests in, or sheds them. A clone is another handle on the same counts.
#[derive(Debug, Clone)]
pub struct Admission(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    lifecycle: Lifecycle,
    rates: Option<Rates>,
    /// Requests of a key at once, where it says nothing of that.
    at_once_max: Option<NonZeroU32>,
    streams: Quota,
    watches: Quota,
    /// Streams and watches of one caller.
    stream_shares: Shares,
    watch_shares: Shares,
    bodies: Bodies,
    probes: Probes,
}

/// An answer of no more bytes than this is not counted: `requests_max` bounds how many there are, and `streams_max`
/// with what a stream keeps ahead of its reader.
const SMALL_ANSWER_BYTES: usize = 16 << 10;

/// Bytes of memory that an answer takes besides those of its body that are there already: to be put among its
/// extensions by a handler whose body is made later.
#[derive(Debug, Clone, Copy)]
pub struct AnswerBytes(pub usize);

/// Memory that an answer takes until it is sent: what its handler says, or the bytes of a body that is there as a
/// whole.
fn answer_bytes(response: &mut Response) -> usize {
    let whole = HttpBody::size_hint(response.body()).exact().unwrap_or_default();
    let bytes = response.extensions_mut().remove().map_or(whole as usize, |AnswerBytes(bytes)| bytes);
    if bytes > SMALL_ANSWER_BYTES { bytes } else { 0 }
}

impl Admission {
    /// Nobody is in.
    pub fn new(limits: &Limits, lifecycle: Lifecycle) -> Self {
        Self(Arc::new(Inner {
            lifecycle,
            rates: Rates::new(limits),
            at_once_max: NonZeroU32::new(limits.caller_requests_at_once_max),
            streams: Quota::new("streams_max", limits.streams_max),
            watches: Quota::new("watches_max", limits.watches_max),
            stream_shares: Shares::new("caller_streams_max", "streams", limits.caller_streams_max),
            watch_shares: Shares::new("caller_watches_max", "watches", limits.caller_watches_max),
            bodies: Bodies::new(limits),
            probes: Probes::new(limits),
        }))
    }

    /// Lets a request in and answers it by `handle`. It counts until its answer is sent, or was ended by `endings`.
    ///
    /// # Errors
    /// `ResourceExhausted` with the name of the limit that it would exceed; `Unavailable` when the server is going
    /// down; `DeadlineExceeded` when its body does not come.
    pub async fn answer<F>(
        &self,
        operation: Operation,
        request: Request,
        endings: Endings,
        handle: impl FnOnce(Request) -> F,
    ) -> Result<Response, ServiceError>
    where
        F: Future<Output = Result<Response, ServiceError>>,
    {
        self.check_connection(operation, &request)?;
        if operation.is_probe() {
            return self.0.probes.answer(operation, request, endings, handle).await;
        }
        let asking = RateLimitKey::of(request.extensions());
        let of = match operation {
            watch if watch.is_watch() => Some((&self.0.watch_shares, &self.0.watches)),
            _ => operation.is_stream().then_some((&self.0.stream_shares, &self.0.streams)),
        };
        // Its own share first, so that a caller who has it is told that and not that others have too much.
        let share = of.map(|(shares, _)| asking.take(shares)).transpose()?;
        let place = of.map(|(_, quota)| quota.take()).transpose()?;
        self.check_rate(&asking)?;
        let own_place = asking.begin(self.0.at_once_max)?;
        let hang_up = request.extensions().get().cloned();
        let arrival = InboundBody::begin(&self.0.bodies, operation.is_stream(), hang_up)?;
        let let_in = request.extensions().get().map(OfConnection::let_in);
        let request = Self::metered(request, &arrival)?;
        let answered = self.0.lifecycle.admit(handle(request)).await?;
        let mut response = arrival.refusal().map_or(answered, Err)?;
        // Streams are told that the server is going down; other answers are waited for.
        let held = (!operation.is_stream()).then(|| self.0.lifecycle.hold());
        if held.is_some() {
            drop(arrival.take());
            match answer_bytes(&mut response) {
                0 => {}
                bytes => arrival.add(bytes)?,
            }
        }
        let held = (place, share, own_place, held, let_in);
        Ok(response.map(|body| Body::new(AnswerBody::new(body, Some(arrival), held, endings))))
    }

    /// Notes that a key came by a connection, and keeps to health what was taken for it.
    fn check_connection(&self, operation: Operation, request: &Request) -> Result<(), ServiceError> {
        let Some(connection) = request.extensions().get::<OfConnection>() else { return Ok(()) };
        let authorized = request.extensions().get::<Authorized>();
        if let Some(name) = authorized.and_then(|authorized| authorized.caller.name()) {
            connection.show_key(name);
        }
        connection.check(operation.is_probe() && operation != Operation::Metrics)
    }

    /// Lets the next message of a stream in.
    ///
    /// # Errors
    /// `ResourceExhausted` when the caller asks too often.
    pub fn check_rate(&self, asking: &RateLimitKey) -> Result<(), ServiceError> {
        asking.check_rate(self.0.rates.as_ref())
    }

    /// Whether the server is going down.
    pub fn lifecycle(&self) -> &Lifecycle {
        &self.0.lifecycle
    }

    /// Comes when the server is going down: what ends an answer that lasts as long as its client wishes.
    pub fn told_to_drain(&self) -> impl Future<Output = ServiceError> + Send + use<> {
        let lifecycle = self.0.lifecycle.clone();
        async move {
            lifecycle.draining().await;
            draining()
        }
    }

    /// Memory that an answer takes until it is sent.
    ///
    /// # Errors
    /// `ResourceExhausted` when there is no room.
    pub fn keep(&self, bytes: usize) -> Result<MemoryPermit, ServiceError> {
        self.0.bodies.charge(bytes)
    }

    /// Memory that an answer of a stream takes until it is sent; none of a small one, of which `streams_max` bounds how
    /// many there are.
    ///
    /// # Errors
    /// `ResourceExhausted` when there is no room.
    pub fn keep_answer(&self, bytes: usize) -> Result<Option<MemoryPermit>, ServiceError> {
        (bytes > SMALL_ANSWER_BYTES).then(|| self.keep(bytes)).transpose()
    }

    /// How long the text of a scrape answers those that follow.
    pub fn scrape_kept(&self) -> Duration {
        self.0.probes.scrape_kept()
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
        let (streams, watches) = (self.0.streams.taken(), self.0.watches.taken());
        InUse { streams, watches, ..self.0.bodies.in_use() }
    }

    /// The request with a body that is counted as it arrives; a handler finds the [`InboundBody`] among its extensions.
    fn metered(mut request: Request, arrival: &InboundBody) -> Result<Request, ServiceError> {
        request.extensions_mut().insert(arrival.clone());
        // Of other requests nobody reads the body to its end.
        let body_is_read = matches!(*request.method(), Method::POST | Method::PUT);
        if !body_is_read {
            arrival.complete()?;
        }
        Ok(request.map(|body| Body::new(MeteredBody::new(body, arrival.clone()))))
    }
}
