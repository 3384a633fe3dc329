//! Threads for work that uses the CPU: pools, fair queues before them, and limits of time.

mod asker;
mod fair_queue;
mod pool;
mod pools;
mod time_limit;

pub use asker::Asker;
pub use pool::PoolUse;
pub(crate) use pool::{FreeThread, Pool};
pub(crate) use pools::Pools;
pub(crate) use time_limit::{TimeLimit, check_not_stopped, ended_early};
