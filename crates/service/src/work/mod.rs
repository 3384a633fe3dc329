//! Threads for work that uses the CPU: lanes, the fair queues before them, and limits of time.

mod asker;
mod background;
mod failures;
mod fair_queue;
mod lane;
mod lanes;
mod pause;
mod precedence;
mod row;
mod shares;
mod threads;
mod time_limit;

pub use asker::Asker;
pub(crate) use asker::Requester;
pub use lane::LaneUse;
pub(crate) use lane::{FreeThread, Lane};
pub(crate) use lanes::Lanes;
pub(crate) use row::{Row, TURN};
pub(crate) use shares::{Share, Shares};
pub(crate) use time_limit::{TimeLimit, check_not_stopped, ended_early};
