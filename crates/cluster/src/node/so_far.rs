//! What a node has seen so far of who leads a map.

use mrol_service::Lead;
use uuid::Uuid;

use super::claimed::Claimed;
use super::release::Progress;
use super::view::View;

/// What a node has seen so far of who leads a map, from look to look.
#[derive(Debug, Default)]
pub(super) struct SoFar {
    /// This node's claim.
    pub(super) claimed: Claimed,
    /// The last claim of another that it has read.
    heard: Option<Uuid>,
    /// Its beats since which it waits for somebody to lead.
    waits_since: Option<u64>,
    doubt: Doubt,
    beats: u64,
    /// How far its copy was two beats ago, and one.
    progress: [Option<Progress>; 2],
}

/// What is to be done about what a node has just seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Noted {
    /// Another has claimed, and waits for what this node has.
    pub(super) is_claimed: bool,
    /// It has not been able to tell for two beats whether its copy has the history of the log.
    pub(super) is_doubtful: bool,
}

impl SoFar {
    /// Notes who leads, by the log and by the beats of the others.
    pub(super) fn note(&mut self, map: Uuid, lead: &Lead, view: &View) -> Noted {
        let mut noted = Noted { is_claimed: false, is_doubtful: false };
        let Lead::Shared { leader, is_here, has_claimed, claim, agrees, .. } = lead else { return noted };
        let is_seen = |leader| view.holders(map).any(|(node, head)| node == leader && head.leads);
        if *is_here || leader.as_ref().is_some_and(is_seen) {
            self.waits_since = None;
        }
        if *has_claimed {
            self.claimed.note(*claim, view);
        } else if *claim != self.heard {
            // It is waited for from then on.
            (self.heard, self.waits_since) = (*claim, None);
            noted.is_claimed = true;
        }
        self.waits_since.get_or_insert(view.beats);
        noted.is_doubtful = self.doubt.is_news(*agrees, view.beats);
        noted
    }

    /// Notes how far the copy is, at `revision`, with each beat.
    pub(super) fn note_progress(&mut self, lead: &Lead, revision: u64, view: &View) {
        if std::mem::replace(&mut self.beats, view.beats) == view.beats {
            return;
        }
        // Before it has joined its log, that says nothing.
        let there = match lead {
            Lead::Shared { sequence, .. } => Some(Progress { sequence: *sequence, revision }),
            _ => None,
        };
        self.progress = [self.progress[1].filter(|_| there.is_some()), there];
    }

    /// Its beats since it saw nobody lead, and no new claim of another.
    pub(super) fn waited(&self, view: &View) -> u64 {
        self.waits_since.map_or(0, |since| view.beats.saturating_sub(since))
    }

    /// How far its copy was a beat ago at least, where that is known.
    pub(super) fn before(&self) -> Option<Progress> {
        self.progress[0]
    }
}

/// That a node cannot tell whether it has the history of the log: for a moment, while it reads, or for longer.
#[derive(Debug, Default)]
struct Doubt {
    /// Its beats when that began, and whether it was told since.
    since: Option<(u64, bool)>,
}

impl Doubt {
    /// True once it has lasted for two beats.
    fn is_news(&mut self, agrees: bool, beats: u64) -> bool {
        if agrees {
            self.since = None;
            return false;
        }
        let (since, is_told) = self.since.get_or_insert((beats, false));
        let lasts = beats >= *since + 2;
        lasts && !std::mem::replace(is_told, lasts)
    }
}

#[cfg(test)]
mod tests {
    use mrol_service::replication::NodeName;

    use super::*;

    const MAP: Uuid = Uuid::from_u128(1);

    fn lead(claim: u128, agrees: bool) -> Lead {
        Lead::Shared {
            leader: NodeName::new("a").ok(),
            is_here: false,
            has_claimed: false,
            epoch: 1,
            claim: Some(Uuid::from_u128(claim)),
            sequence: 5,
            agrees,
        }
    }

    fn at(beats: u64) -> View {
        View { beats, ..View::default() }
    }

    #[test]
    fn whoever_reads_another_s_claim_waits_anew() {
        let mut so_far = SoFar::default();
        assert!(so_far.note(MAP, &lead(1, true), &at(1)).is_claimed);
        assert!(!so_far.note(MAP, &lead(1, true), &at(5)).is_claimed);
        assert_eq!(so_far.waited(&at(5)), 4);
        assert!(so_far.note(MAP, &lead(2, true), &at(6)).is_claimed);
        assert_eq!(so_far.waited(&at(6)), 0);
    }

    #[test]
    fn a_doubt_that_lasts_is_news_once() {
        let mut so_far = SoFar::default();
        let mut news = |agrees, beats| so_far.note(MAP, &lead(1, agrees), &at(beats)).is_doubtful;
        assert_eq!([1, 2, 3, 4].map(|beats| news(false, beats)), [false, false, true, false]);
        assert_eq!(
            [(true, 5), (false, 6), (false, 8)].map(|(agrees, beats)| news(agrees, beats)),
            [false, false, true]
        );
    }

    #[test]
    fn a_copy_s_progress_is_known_a_beat_later() {
        let mut so_far = SoFar::default();
        for (beats, revision) in [(1, 5), (1, 6), (2, 7)] {
            assert_eq!(so_far.before(), None);
            so_far.note_progress(&lead(1, true), revision, &at(beats));
        }
        assert_eq!(so_far.before(), Some(Progress { sequence: 5, revision: 5 }));
        so_far.note_progress(&Lead::NotJoined, 7, &at(3));
        assert_eq!(so_far.before(), None);
    }
}
