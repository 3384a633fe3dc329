//! The locks of maps and of their folders: their order, and what may be done while one is held.
//!
//! Every lock has a [`Rank`]. A thread takes locks in ascending order of their ranks, so that no two threads wait for
//! each other. Four rules follow from what the locks protect:
//!
//! * A thread that polls async tasks never waits for a lock that somebody may hold for long: it would keep every other
//!   connection waiting with it, health checks among them. It may `try_` such a lock, and hand the work to a pool
//!   where that fails. [`Rank::Brief`] locks are exempt: they are held for a few instructions.
//! * No file operation starts while a lock of a map's content is held: a slow disk would stop its readers.
//! * Work that lets other work go first ([`StopSignal::give_way`](crate::util::StopSignal::give_way)) holds no lock.
//! * While a [`Rank::Brief`] lock is held no other lock is taken and no file operation starts.
//!
//! With `debug_assertions`, so in every test, a breach panics at the line that commits it (`checks`). Without, the
//! locks are `parking_lot`'s and cost nothing more. With the feature `shuttle`, which is for two tests alone
//! (`tests/commit_protocol.rs` here, `src/tests/modeled.rs` of the service), they are those of a model checker: it runs
//! a test's threads one at a time, and at every lock chooses who goes on.

mod checks;
mod locks;
#[cfg_attr(feature = "shuttle", path = "modeled.rs")]
#[cfg_attr(not(feature = "shuttle"), path = "native.rs")]
mod primitive;
mod rank;

pub use checks::{before_file_operation, before_pause, polled_by_runtime};
pub use locks::{Mutex, MutexGuard, RwLock, RwLockReadGuard, RwLockWriteGuard};
pub use primitive::{AtomicU64, mpsc, thread};
pub use rank::Rank;
