//! Changes: what one revision did to a map, and what a map keeps of its changes.
//!
//! `records` are the changes themselves, `committed` what one came to. A map keeps the answers to requests
//! (`idempotency_log`), its newest revision (`published`) and the followers of its blocks (`followers`);
//! `level_changes` are noted for those who watch levels. How a change is made is in [`super::commit`].

mod committed;
mod followers;
mod idempotency_log;
mod level_changes;
mod published;
mod records;

pub use committed::Committed;
pub(in crate::map) use followers::Followers;
pub use followers::{BlockFollower, TouchedBlocks};
pub use idempotency_log::{
    CompletedRequest, IdempotencyLog, REQUESTS_KEPT, REQUESTS_PER_CALLER_KEPT, RequestKind,
};
pub(in crate::map) use level_changes::KeysOfLevel;
pub use level_changes::{LevelChange, LevelSet};
pub(in crate::map) use published::Published;
pub use records::{Change, DeletionRecord, KeepOutRecord, Request, UndoRecord};
