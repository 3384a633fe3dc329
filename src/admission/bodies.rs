//! The memory of all request bodies; the slowest upload is evicted when it is full.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio_util::sync::CancellationToken;

use super::body_state::{Body, CloseConnection};
use super::quota::Quota;
use crate::telemetry::InUse;
use mrol_service::{Limits, Reason, ServiceError};

/// A body of a request that was silent for less than this gives way to nobody: it may be on a slow path.
const GRACE: Duration = Duration::from_secs(1);

/// The bodies of all requests, and what else lies in the same memory. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub(super) struct Bodies(Arc<Inner>);

/// Bounds on the bodies of some kind of requests.
#[derive(Debug, Clone)]
struct Bounds {
    /// The limit on requests, by its name.
    requests: (&'static str, usize),
    bytes_max: usize,
    silence_max: Duration,
    bytes_per_s_min: u32,
    /// A body that was silent for less than this gives way to nobody.
    grace: Duration,
}

#[derive(Debug)]
struct Inner {
    limits: Bounds,
    /// Slots of requests whose bodies have arrived.
    requests: Quota,
    known: Mutex<Known>,
}

#[derive(Debug, Default)]
struct Known {
    /// By the order in which they began.
    bodies: BTreeMap<u64, Body>,
    next: u64,
    /// Requests whose bodies have not arrived yet; streams do not count.
    arriving: usize,
    /// Bytes of bodies and of memory permits.
    bytes: usize,
}

/// Memory that is in use until this is dropped.
#[derive(Debug)]
pub struct MemoryPermit {
    bodies: Bodies,
    bytes: usize,
}

impl Bodies {
    /// The bodies of requests that work is done for.
    pub(super) fn new(limits: &Limits) -> Self {
        Self::within(Bounds {
            requests: ("requests_max", limits.requests_max),
            bytes_max: limits.body_bytes_max,
            silence_max: Duration::from_secs_f64(limits.body_silence_max_s),
            bytes_per_s_min: limits.body_bytes_per_s_min,
            grace: GRACE,
        })
    }

    /// The bodies of probes, of which the limit `name` allows `most`. Each is small and comes at once, so that the one
    /// that has waited for longest gives way, however short that was: nobody fills all places and keeps them.
    pub(super) fn of_probes(limits: &Limits, name: &'static str, most: usize) -> Self {
        Self::within(Bounds {
            requests: (name, most),
            bytes_max: usize::MAX,
            silence_max: Duration::from_secs_f64(limits.probe_time_max_s),
            bytes_per_s_min: u32::MAX,
            grace: Duration::ZERO,
        })
    }

    fn within(limits: Bounds) -> Self {
        let (name, most) = limits.requests;
        Self(Arc::new(Inner { requests: Quota::new(name, most), limits, known: Mutex::default() }))
    }

    /// A body begins to arrive: its number, and what is cancelled when it is ended.
    ///
    /// # Errors
    /// When as many requests are arriving as may be, and none was silent.
    pub(super) fn begin(
        &self,
        is_stream: bool,
        hang_up: Option<CloseConnection>,
    ) -> Result<(u64, CancellationToken), ServiceError> {
        let mut known = self.0.known.lock();
        if !is_stream {
            let full = known.arriving >= self.0.limits.requests.1;
            if full && !known.end_most_silent(None, self.0.limits.grace, &self.0.requests.refusal()) {
                return Err(self.0.requests.refusal());
            }
            known.arriving += 1;
        }
        let (number, ended) = (known.next, CancellationToken::new());
        known.next += 1;
        known.bodies.insert(number, Body::new(is_stream, ended.clone(), hang_up));
        Ok((number, ended))
    }

    /// More of a body has come.
    ///
    /// # Errors
    /// When there is no room for it, or the body was ended.
    pub(super) fn add(&self, number: u64, bytes: usize) -> Result<(), ServiceError> {
        let mut known = self.0.known.lock();
        let room = self.make_room(&mut known, Some(number), bytes);
        let time = self.time_of(bytes);
        known.change(number, |body| body.add(bytes, time, room)).unwrap_or(Ok(()))
    }

    /// How long so many bytes may take.
    fn time_of(&self, bytes: usize) -> Duration {
        match self.0.limits.bytes_per_s_min {
            0 => Duration::MAX,
            least => Duration::from_secs_f64(bytes as f64 / f64::from(least)),
        }
    }

    /// Somebody waits for more of a body.
    pub(super) fn await_more(&self, number: u64) {
        self.0.known.lock().change(number, Body::await_more);
    }

    /// As [`Bodies::add`], for what is missing to `bytes`.
    pub(super) fn at_least(&self, number: u64, bytes: usize) -> Result<(), ServiceError> {
        let known = self.0.known.lock().bodies.get(&number).map_or(0, Body::bytes);
        self.add(number, bytes.saturating_sub(known))
    }

    /// All of a body has come: from now on it counts as a request in work.
    ///
    /// # Errors
    /// When as many are in work as may be.
    pub(super) fn complete(&self, number: u64) -> Result<(), ServiceError> {
        let mut known = self.0.known.lock();
        if self.0.requests.is_full() {
            known.hang_up_on_least_read(self.0.limits.grace, &self.0.requests.refusal());
        }
        known.change(number, |body| body.complete(&self.0.requests)).unwrap_or(Ok(()))
    }

    /// Whether the answer to a body's request waits to be read.
    pub(super) fn set_unread(&self, number: u64, waits: bool) {
        self.0.known.lock().change(number, |body| body.set_unread(waits));
    }

    /// The bytes of a body are somebody else's now, or nobody's.
    pub(super) fn take(&self, number: u64) -> MemoryPermit {
        let mut known = self.0.known.lock();
        let bytes = known.change(number, Body::take_bytes).unwrap_or_default();
        // They are in use as before, by the charge.
        known.bytes += bytes;
        MemoryPermit { bodies: self.clone(), bytes }
    }

    /// Why a body was ended.
    pub(super) fn refusal(&self, number: u64) -> Option<ServiceError> {
        self.0.known.lock().bodies.get(&number)?.refusal().cloned()
    }

    /// Memory for something else.
    ///
    /// # Errors
    /// When there is no room.
    pub(super) fn charge(&self, bytes: usize) -> Result<MemoryPermit, ServiceError> {
        let mut known = self.0.known.lock();
        self.make_room(&mut known, None, bytes)?;
        known.bytes += bytes;
        Ok(MemoryPermit { bodies: self.clone(), bytes })
    }

    /// Nobody has to do with a body any more.
    pub(super) fn forget(&self, number: u64) {
        let mut known = self.0.known.lock();
        if let Some(body) = known.bodies.remove(&number) {
            known.arriving -= usize::from(body.is_arriving());
            known.bytes -= body.bytes();
        }
    }

    /// Ends the bodies that have been silent for longer than they may.
    pub(super) fn end_silent(&self) {
        let Bounds { silence_max, bytes_per_s_min: least, .. } = self.0.limits;
        let message = format!(
            "body_silence_max is {silence_max:?}, body_bytes_per_s_min is {least}: nothing more of the body came, or too slowly"
        );
        let refusal = ServiceError::new(Reason::BodyStalled, message);
        let mut known = self.0.known.lock();
        let silent = |body: &Body| body.silence().is_some_and(|silence| silence >= silence_max);
        let numbers: Vec<u64> =
            known.bodies.iter().filter(|(_, body)| silent(body)).map(|(&number, _)| number).collect();
        for number in numbers {
            known.change(number, |body| body.end(refusal.clone()));
        }
    }

    pub(super) fn in_use(&self) -> InUse {
        let known = self.0.known.lock();
        InUse {
            requests: self.0.requests.taken(),
            arriving: known.arriving,
            bytes: known.bytes,
            ..InUse::default()
        }
    }

    /// Ends silent bodies other than `own`, and then answers that nobody reads, until there is room for `bytes`.
    fn make_room(&self, known: &mut Known, own: Option<u64>, bytes: usize) -> Result<(), ServiceError> {
        let most = self.0.limits.bytes_max;
        let refusal = || {
            ServiceError::overloaded(format!(
                "body_bytes_max is {most}: other requests hold that much, try again"
            ))
        };
        while known.bytes.saturating_add(bytes) > most {
            if !known.end_most_silent(own, self.0.limits.grace, &refusal()) {
                // Of one that holds its answer elsewhere, the memory is free a little later.
                let freed = known.hang_up_on_least_read(self.0.limits.grace, &refusal());
                if freed.is_none_or(|bytes| bytes == 0) {
                    return Err(refusal());
                }
            }
        }
        Ok(())
    }
}

impl Known {
    /// Ends the body that has been silent for longest and is not `own`; false where there is none. What it had in
    /// memory is free.
    fn end_most_silent(&mut self, own: Option<u64>, grace: Duration, refusal: &ServiceError) -> bool {
        let others = self.bodies.iter().filter(|(number, _)| Some(**number) != own);
        let silent = others.filter_map(|(&number, body)| {
            Some((body.silence().filter(|silence| *silence >= grace)?, number))
        });
        let Some((_, number)) = silent.max() else {
            return false;
        };
        self.change(number, |body| body.end(refusal.clone()));
        true
    }

    /// Ends the request whose answer has waited to be read for longest, with its connection; the bytes that it held, if
    /// there is one.
    fn hang_up_on_least_read(&mut self, grace: Duration, refusal: &ServiceError) -> Option<usize> {
        let unread_for = |body: &Body| body.unread_for().filter(|wait| *wait >= grace);
        let unread = self.bodies.iter().filter_map(|(&number, body)| Some((unread_for(body)?, number)));
        let (_, number) = unread.max()?;
        self.change(number, |body| {
            let bytes = body.bytes();
            body.end(refusal.clone());
            body.hang_up();
            bytes
        })
    }

    /// Changes a body, and the sums with it.
    fn change<T>(&mut self, number: u64, change: impl FnOnce(&mut Body) -> T) -> Option<T> {
        let body = self.bodies.get_mut(&number)?;
        self.bytes -= body.bytes();
        self.arriving -= usize::from(body.is_arriving());
        let changed = change(body);
        self.bytes += body.bytes();
        self.arriving += usize::from(body.is_arriving());
        Some(changed)
    }
}

impl MemoryPermit {
    /// This permit, for at least `bytes`.
    ///
    /// # Errors
    /// When there is no room for the rest.
    pub fn at_least(mut self, bytes: usize) -> Result<Self, ServiceError> {
        let rest = bytes.saturating_sub(self.bytes);
        if rest > 0 {
            // Both parts are given back by this one.
            let mut more = self.bodies.charge(rest)?;
            self.bytes += std::mem::take(&mut more.bytes);
        }
        Ok(self)
    }
}

impl Drop for MemoryPermit {
    fn drop(&mut self) {
        self.bodies.0.known.lock().bytes -= self.bytes;
    }
}
