//! Places for the connections of a protocol.
//!
//! Where all are taken, a new connection gets that of another: of the one without a key that has been idle, or has left
//! an answer unread, for longest, then of the one that has been idle for longest of the key that has most. A connection
//! is idle that has no request which was let in: refusals, asked for and not read, keep nobody out. Connections that
//! nobody uses can therefore never keep others out, however many there are; those in use are fewer than the places,
//! since requests and streams in flight have lower limits.
//!
//! Should all be in use nonetheless, a new connection gets a place of some that are kept for health checks, for a
//! moment ([`reserved`]).

mod reserved;
mod slots;

pub(crate) use slots::{ConnectionSlot, ConnectionSlots, InUse};
