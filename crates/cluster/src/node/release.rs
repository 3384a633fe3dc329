//! When a node that is to hold a map no more drops its copy.

use std::collections::BTreeMap;

use mrol_service::replication::NodeName;
use uuid::Uuid;

use super::view::View;
use crate::catalog::Holders;

/// Beats that have to be seen of another holder since it was seen that this node is none: what a beat says was so
/// before, and that node may have been about to drop its copy then.
const BEATS_SEEN: u32 = 3;

/// How far a copy is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Progress {
    /// Number of the last message of the log that was read.
    pub(super) sequence: u64,
    /// Revision of the last change.
    pub(super) revision: u64,
}

/// Tells when a node that is to hold a map no more may drop its copy. Told of what is seen with each beat.
#[derive(Debug, Default)]
pub(super) struct Release {
    /// The last beat that was seen of each holder, and how many were since this began.
    beats: BTreeMap<NodeName, (u64, u32)>,
}

impl Release {
    /// True once every live holder, and one at least, has a copy that takes changes and is as far as this node's was a
    /// beat `before`, where that is known. With each call what is seen by then is counted.
    pub(super) fn is_due(
        &mut self,
        map: Uuid,
        holders: &Holders,
        view: &View,
        before: Option<Progress>,
    ) -> bool {
        for (node, seen) in &view.others {
            let (last, count) = self.beats.entry(node.clone()).or_insert((seen.revision, 0));
            *count += u32::from(*last != seen.revision);
            *last = seen.revision;
        }
        let Some(before) = before else { return false };
        let live = view.others.iter().filter(|(node, seen)| seen.is_live && holders.contains(node));
        let is_there = |node: &NodeName| self.beats.get(node).is_some_and(|(_, count)| *count >= BEATS_SEEN);
        let mut live = live.peekable();
        live.peek().is_some()
            && live.all(|(node, seen)| {
                let head = seen.beat.maps.get(&map).filter(|head| !head.is_parted);
                let is_as_far = head
                    .is_some_and(|head| head.sequence >= before.sequence && head.revision >= before.revision);
                is_as_far && is_there(node)
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beat::{Beat, MapHead};
    use crate::node::view::Seen;

    const MAP: Uuid = Uuid::from_u128(1);

    fn node(name: &str) -> NodeName {
        NodeName::new(name).unwrap()
    }

    /// Nodes as they are seen with the beat of a revision: name, whether it is live, the revision of its copy if it has
    /// one, whether that is parted.
    fn view(beat_revision: u64, others: &[(&str, bool, Option<u64>, bool)]) -> View {
        let seen = |&(name, is_live, revision, is_parted): &(&str, bool, Option<u64>, bool)| {
            let head = |revision| {
                (
                    MAP,
                    MapHead {
                        revision,
                        epoch: 1,
                        claim: None,
                        sequence: revision,
                        leads: false,
                        is_parted,
                        agrees: true,
                    },
                )
            };
            let beat =
                Beat { record_version: 1, maps: revision.map(head).into_iter().collect(), ..Beat::default() };
            (node(name), Seen { beat, revision: beat_revision, is_live })
        };
        View { others: others.iter().map(seen).collect(), ..View::default() }
    }

    /// Whether a node that was at revision 5 drops its copy of a map that `b` and `c` hold, after so many beats.
    fn is_dropped(beats: u64, others: &[(&str, bool, Option<u64>, bool)]) -> bool {
        let (mut release, before) = (Release::default(), Some(Progress { sequence: 5, revision: 5 }));
        let holders = Holders::Only([node("b"), node("c")].into());
        let due = (0..=beats).map(|beat| release.is_due(MAP, &holders, &view(beat, others), before));
        due.last().unwrap()
    }

    #[test]
    fn a_copy_is_dropped_once_all_live_holders_are_as_far() {
        let (there, gone) = (("b", true, Some(5), false), ("c", false, None, false));
        assert!(is_dropped(3, &[there, gone]));
        assert!(is_dropped(3, &[there, ("c", true, Some(7), false)]));
        assert!(!is_dropped(9, &[there, ("c", true, Some(4), false)]), "one is behind");
        assert!(!is_dropped(9, &[there, ("c", true, None, false)]), "one has no copy");
        assert!(!is_dropped(9, &[there, ("c", true, Some(5), true)]), "one has parted");
        assert!(!is_dropped(9, &[gone, ("b", false, Some(5), false)]), "none is live");
        assert!(!is_dropped(9, &[("d", true, Some(5), false)]), "that is no holder");
        assert!(!is_dropped(9, &[]));
    }

    #[test]
    fn what_a_beat_of_before_says_does_not_count() {
        let there = [("b", true, Some(5), false)];
        assert!((0..3).all(|beats| !is_dropped(beats, &there)));
        let (mut release, holders) = (Release::default(), Holders::Only([node("b")].into()));
        for _ in 0..9 {
            let before = Some(Progress { sequence: 0, revision: 0 });
            let same = release.is_due(MAP, &holders, &view(1, &there), before);
            assert!(!same, "it was the same beat each time");
        }
        let unknown = (2..9).any(|beat| release.is_due(MAP, &holders, &view(beat, &there), None));
        assert!(!unknown, "how far this node is must be known");
    }
}
