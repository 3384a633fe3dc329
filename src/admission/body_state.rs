//! What is known of one body on its way in.

use std::time::Duration;

use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::quota::{Quota, QuotaSlot};
use mrol_service::ServiceError;

/// What is known of a body.
#[derive(Debug)]
pub(super) struct Body {
    is_stream: bool,
    /// Bytes of the body that are in memory.
    bytes: usize,
    /// Up to when they came in time: each accounts for a part of a second, and none for time to come.
    in_time: Instant,
    /// Since when nothing waits for more: meanwhile the client is not the silent side.
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
    /// All of the body has come: it counts as a request in work.
    Complete {
        _slot: QuotaSlot,
        /// Since when its answer waits to be read.
        unread: Option<Instant>,
    },
    /// The body was ended before it was complete.
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

    /// Notes whether the answer waits to be read.
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
            let slot = requests.take();
            let slot = slot.inspect_err(|refusal| self.state = State::Ended(refusal.clone()))?;
            self.state = State::Complete { _slot: slot, unread: None };
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
