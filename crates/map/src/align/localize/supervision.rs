//! Supervision of a search by its caller.

use super::answer::{LocalizationError, SearchProgress};
use crate::util::StopSignal;

/// Callbacks of a search: when to end, where to report progress, and how much memory to take.
pub struct Supervision<'a> {
    /// Stop signal of all phases, checked every few milliseconds. Once set, the search returns what it has.
    pub stop: StopSignal<'a>,
    /// Stop signal of the search phase alone. What was found until then is still refined, as long as `stop` allows.
    pub search_stop: StopSignal<'a>,
    /// Called with the progress every few hundred cells.
    pub progress: &'a mut dyn FnMut(&SearchProgress),
    /// Called before memory is taken, with the number of bytes in addition to all those before. False refuses the
    /// memory and ends the search.
    pub reserve: &'a mut dyn FnMut(usize) -> bool,
}

impl std::fmt::Debug for Supervision<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Supervision").field("stop", &self.stop).finish_non_exhaustive()
    }
}

/// Why the data structures of a search were not built.
#[derive(Debug)]
pub(super) enum Unbuilt {
    /// Building was stopped, so there is nothing to search in.
    Stopped,
    /// The data structures cannot be built, for the reason given.
    Refused(LocalizationError),
}

impl From<LocalizationError> for Unbuilt {
    fn from(error: LocalizationError) -> Self {
        Self::Refused(error)
    }
}

/// # Errors
/// When the work is to end.
pub(super) fn check(stop: StopSignal<'_>) -> Result<(), Unbuilt> {
    if stop.is_stopped() { Err(Unbuilt::Stopped) } else { Ok(()) }
}

impl Supervision<'_> {
    /// # Errors
    /// When there is no memory for `bytes` more.
    pub(super) fn take(&mut self, bytes: usize) -> Result<(), LocalizationError> {
        if (self.reserve)(bytes) { Ok(()) } else { Err(LocalizationError::NoMemory { bytes }) }
    }
}
