//! Scans of robots: inserted, aligned, located with no guess; the events and the trajectory that come of them.
//!
//! A scan comes in by `insert`, which waits for its robot's lock and for a thread; `submit` then filters it
//! (`filtered`), locates it (`mapper`) and sets it on its way into the map. Where it is refused, `recovery` searches
//! for its robot.

mod event_watch;
mod events;
mod filtered;
mod insert;
mod localization;
mod mapper;
mod recovery;
mod submit;
mod trajectory;

pub use event_watch::EventWatch;
pub use localization::{
    CANDIDATES_DEFAULT, CandidateAnswer, LocalizationAnswer, LocalizationRequest, SEARCH_SHARE,
    TIME_LIMIT_DEFAULT,
};
#[cfg(all(test, feature = "shuttle"))]
pub(crate) use submit::Effort;
pub use trajectory::TrajectoryPieces;
