//! What a search asks of whoever started it.

use super::{LocalizationError, SearchProgress};
use crate::util::StopSignal;

/// When a search is to end, who hears how far it is, and what memory it may have.
pub struct Supervision<'a> {
    /// Asked every few milliseconds, in every phase. Stopped, a search answers with what it has.
    pub stop: StopSignal<'a>,
    /// Asked by the search alone, as often: what it found until then is refined while `stop` lets it.
    pub search_stop: StopSignal<'a>,
    /// Told every few hundred cells.
    pub progress: &'a mut dyn FnMut(&SearchProgress),
    /// Asked before memory is taken, for so many bytes beside all those before: false refuses them, and ends the search.
    pub reserve: &'a mut dyn FnMut(usize) -> bool,
}

impl std::fmt::Debug for Supervision<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Supervision").field("stop", &self.stop).finish_non_exhaustive()
    }
}

/// Why what a search reads was not built.
#[derive(Debug)]
pub(super) enum Unbuilt {
    /// Building was stopped: there is nothing to search in.
    Stopped,
    /// What is searched in cannot be built.
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
