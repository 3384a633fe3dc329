//! The threads of a lane that are free, and the jobs that wait for one.
//!
//! Askers take turns, and the robots of an asker among themselves, as the [`Row`](super::row::Row) says: so a caller
//! that asks one question waits for about one question of a caller that asks many. What one robot asks is begun in
//! order. Long work gives its thread back between its parts where somebody else waits, and is first of its own
//! requester's when their turn comes again.
//!
//! No more wait than may. Where one more comes, somebody who has two more waiting than the newcomer's asker loses the
//! last of them: whoever asks much is refused, and not whoever comes late.

mod queue;
#[cfg(test)]
mod tests;

pub(super) use queue::{FairQueue, HeldThread};
