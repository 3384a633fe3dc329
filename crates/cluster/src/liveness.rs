//! Who is gone.

use std::collections::BTreeMap;

use mrol_service::replication::NodeName;

/// Own beats that were acknowledged since a node's last, after which it counts as gone: eight seconds. A halt of a
/// second and a beat that was lost make nobody gone.
pub(crate) const OWN_BEATS: u64 = 4;

/// The same, where the node's port refuses as well: nothing listens there, so its process is gone.
const OWN_BEATS_IF_REFUSED: u64 = 1;

/// Who is gone, by the beats of all and without a clock: a node's silence is measured in one's own beats that were
/// acknowledged meanwhile. Who cannot reach the engine himself, and everybody while it is out, sees nobody go.
///
/// Told of beats and ports in the order in which they are seen; does nothing by itself.
#[derive(Debug, Clone)]
pub struct Liveness {
    own: NodeName,
    /// Own beats that were acknowledged.
    beats: u64,
    /// Revision of the last of them.
    acknowledged: Option<u64>,
    others: BTreeMap<NodeName, LastBeat>,
}

/// The last beat that was seen of a node.
#[derive(Debug, Clone, Copy)]
struct LastBeat {
    revision: u64,
    /// Own beats that were acknowledged when it was seen.
    at: u64,
    /// True once the port refused since.
    is_refused: bool,
    /// True where it is not the first that was seen of the node: the node beat since then.
    is_later: bool,
}

impl Liveness {
    /// Of a node that knows of no others yet.
    pub fn new(own: NodeName) -> Self {
        Self { own, beats: 0, acknowledged: None, others: BTreeMap::new() }
    }

    /// One's own beat was acknowledged, as this revision of the bucket.
    pub fn own_beat_acknowledged(&mut self, revision: u64) {
        self.beats += 1;
        self.acknowledged = Some(revision);
    }

    /// A beat of one's own between two of those was acknowledged, which measures no silence.
    pub fn beat_between_acknowledged(&mut self, revision: u64) {
        self.acknowledged = Some(revision);
    }

    /// All beats were read: the revision of each node's last. False, and nothing is made of it, where one's own last is
    /// not among them: what was read is older, and says nothing about the silence of others.
    pub fn beats_read(&mut self, revisions: &BTreeMap<NodeName, u64>) -> bool {
        if self.acknowledged.is_some() && revisions.get(&self.own) != self.acknowledged.as_ref() {
            return false;
        }
        let others = revisions.iter().filter(|(node, _)| **node != self.own);
        let last = |(node, &revision): (&NodeName, &u64)| {
            let before = self.others.get(node);
            let seen = before.filter(|last| last.revision == revision);
            let new = LastBeat { revision, at: self.beats, is_refused: false, is_later: before.is_some() };
            (node.clone(), seen.copied().unwrap_or(new))
        };
        self.others = others.map(last).collect();
        true
    }

    /// Nothing listens at a node's port: a connection was refused, which is more than that it was not answered.
    pub fn port_refused(&mut self, node: &NodeName) {
        if let Some(last) = self.others.get_mut(node) {
            last.is_refused = true;
        }
    }

    /// The other nodes of which no beat was seen since one's own last but one: their ports are worth a look.
    pub fn silent(&self) -> impl Iterator<Item = &NodeName> {
        self.others.iter().filter(|(_, last)| self.beats > last.at).map(|(node, _)| node)
    }

    /// True of another node that beat, and is silent since.
    pub fn is_gone(&self, node: &NodeName) -> bool {
        self.others.get(node).is_some_and(|last| {
            let needed = if last.is_refused { OWN_BEATS_IF_REFUSED } else { OWN_BEATS };
            self.beats - last.at >= needed
        })
    }

    /// True once it is known of every other node whether it is gone: the others have beaten since they were seen first.
    pub fn is_settled(&self) -> bool {
        self.others.iter().all(|(node, last)| last.is_later || self.is_gone(node))
    }

    /// The other nodes that are not gone, in order of their names.
    pub fn live(&self) -> impl Iterator<Item = &NodeName> {
        self.others.keys().filter(|node| !self.is_gone(node))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(name: &str) -> NodeName {
        NodeName::new(name).unwrap()
    }

    /// The node `a`, which sees the bucket as a test has it.
    struct Seen {
        liveness: Liveness,
        bucket: BTreeMap<NodeName, u64>,
        revision: u64,
    }

    impl Seen {
        fn new() -> Self {
            let mut this = Self { liveness: Liveness::new(node("a")), bucket: BTreeMap::new(), revision: 0 };
            this.beat("b");
            this.own_beat();
            this
        }

        fn beat(&mut self, name: &str) {
            self.revision += 1;
            self.bucket.insert(node(name), self.revision);
        }

        /// Beats, is acknowledged and reads all.
        fn own_beat(&mut self) {
            self.beat("a");
            self.liveness.own_beat_acknowledged(self.revision);
            assert!(self.liveness.beats_read(&self.bucket));
        }

        fn is_gone(&self) -> bool {
            let is_live = self.liveness.live().any(|live| *live == node("b"));
            assert_ne!(is_live, self.liveness.is_gone(&node("b")));
            self.liveness.is_gone(&node("b"))
        }
    }

    #[test]
    fn a_node_is_gone_after_four_own_beats_without_one_of_it() {
        let mut seen = Seen::new();
        for _ in 0..3 {
            seen.own_beat();
            assert!(!seen.is_gone());
        }
        seen.own_beat();
        assert!(seen.is_gone());
        seen.beat("b");
        seen.own_beat();
        assert!(!seen.is_gone(), "it is back");
    }

    #[test]
    fn a_node_that_beats_is_never_gone() {
        let mut seen = Seen::new();
        for _ in 0..50 {
            seen.own_beat();
            seen.own_beat();
            seen.beat("b");
            assert!(!seen.is_gone());
        }
    }

    #[test]
    fn a_node_whose_port_refuses_is_gone_after_one_own_beat() {
        let mut seen = Seen::new();
        seen.liveness.port_refused(&node("b"));
        assert!(!seen.is_gone(), "its beat may be on its way");
        seen.own_beat();
        assert!(seen.is_gone());
        seen.beat("b");
        seen.own_beat();
        assert!(!seen.is_gone(), "it was started again");
        seen.own_beat();
        assert!(!seen.is_gone(), "its port refused before its last beat");
    }

    #[test]
    fn an_outage_of_the_engine_makes_nobody_gone() {
        let mut seen = Seen::new();
        for _ in 0..100 {
            assert!(seen.liveness.beats_read(&seen.bucket));
            assert!(!seen.is_gone());
        }
        // Back, and one's own beat is the first by some.
        (0..3).for_each(|_| seen.own_beat());
        assert!(!seen.is_gone());
    }

    #[test]
    fn what_is_older_than_ones_own_last_beat_says_nothing() {
        let mut seen = Seen::new();
        let older = seen.bucket.clone();
        seen.own_beat();
        seen.beat("c");
        seen.own_beat();
        assert!(!seen.liveness.beats_read(&older));
        assert!(seen.liveness.live().any(|live| *live == node("c")));
    }

    #[test]
    fn a_node_that_is_seen_first_has_four_beats_from_then() {
        let mut seen = Seen::new();
        (0..10).for_each(|_| seen.own_beat());
        seen.beat("c");
        seen.own_beat();
        assert!(!seen.liveness.is_gone(&node("c")) && seen.is_gone());
        (0..4).for_each(|_| seen.own_beat());
        assert!(seen.liveness.is_gone(&node("c")));
    }

    #[test]
    fn nodes_that_were_there_before_are_known_to_be_live_once_they_beat_again_or_are_gone() {
        let mut seen = Seen::new();
        seen.bucket.insert(node("left"), 0);
        seen.own_beat();
        assert!(!seen.liveness.is_settled(), "nothing was heard of b and left since");
        seen.beat("b");
        seen.own_beat();
        assert!(!seen.liveness.is_settled());
        (0..4).for_each(|_| {
            seen.beat("b");
            seen.own_beat();
        });
        assert!(seen.liveness.is_settled() && seen.liveness.is_gone(&node("left")) && !seen.is_gone());
    }

    #[test]
    fn a_node_that_was_never_seen_or_has_left_is_not_gone() {
        let mut seen = Seen::new();
        assert!(!seen.liveness.is_gone(&node("z")));
        assert!(!seen.liveness.is_gone(&node("a")), "nobody is gone for itself");
        (0..5).for_each(|_| seen.own_beat());
        seen.bucket.remove(&node("b"));
        seen.own_beat();
        assert!(!seen.liveness.is_gone(&node("b")));
    }
}
