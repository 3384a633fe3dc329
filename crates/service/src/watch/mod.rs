//! Watching a map: its state, and then each change as it becomes durable.
//!
//! ```text
//! revisions    |--- journal ---------------------|--- ring ---|  head
//! who is told  of a revision in the ring           its change, made into bytes once for all
//!              of one that only the journal has    changes, read a batch at a time
//!              of none, or of one out of reach     the whole state, then what came since
//! ```
//!
//! A watcher is where it is: nothing waits for it, and nothing is kept for it. Its next message is made when there is
//! room for it on the way to its client. A watch that falls behind the ring is told from the journal, and behind that
//! of the whole state.

mod backpressure;
mod map_watch;
mod state_parts;
mod whole_state;

pub(crate) use backpressure::{Teller, stream_of};
pub use map_watch::Watch;
