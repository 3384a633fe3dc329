//! What a node waits for that has claimed to lead a map.

use std::time::Duration;

use mrol_service::Lead;
use uuid::Uuid;

use super::view::View;

/// How often a node that has claimed looks at the beats of the others, and how many times: they beat as soon as they
/// have read its claim.
pub(super) const LOOKED_EVERY: Duration = Duration::from_millis(100);
const LOOKS_MAX: u32 = 20;

/// A claim of this node.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Claimed {
    id: Option<Uuid>,
    /// Its beats before, those in between counted.
    beats_before: u64,
    /// A revision of the beats' bucket after it.
    pub(super) at: Option<u64>,
    /// Looks at the beats since.
    pub(super) looks: u32,
}

impl Claimed {
    /// Notes what this node sees that has claimed.
    pub(super) fn note(&mut self, id: Option<Uuid>, view: &View) {
        if self.id != id {
            *self = Self { id, beats_before: view.all_beats, ..Self::default() };
        }
        // The first that is acknowledged may have begun before the claim. Where an older copy of the bucket was put
        // back, its revisions are smaller from then on.
        if view.all_beats >= self.beats_before + 2 {
            self.at = Some(self.at.map_or(view.revision, |at| at.min(view.revision)));
        }
    }

    /// True while the others' beats are looked at more often.
    pub(super) fn waits(&self, lead: &Lead) -> bool {
        matches!(lead, Lead::Shared { is_here: false, has_claimed: true, .. }) && self.looks < LOOKS_MAX
    }
}
