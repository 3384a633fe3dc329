//! Which nodes have room for a new map.

use std::cmp::Reverse;

use mrol_service::replication::NodeName;

use super::view::View;
use crate::catalog::Holders;
use crate::liveness::OWN_BEATS;

/// The nodes that are to hold a map which is made at `own`: `copies` of them, all where that is 0. The first is `own`,
/// the others are the live nodes with the most room on their disks; of equals, those with the fewest maps, and then the
/// first names. Fewer, where fewer are live.
pub(super) fn holders(copies: usize, own: &NodeName, view: &View) -> Holders {
    if copies == 0 {
        return Holders::All;
    }
    let mut live: Vec<_> = view.others.iter().filter(|(_, seen)| seen.is_live).collect();
    live.sort_by_key(|(node, seen)| (Reverse(seen.beat.free_bytes), seen.beat.maps.len(), *node));
    let others = live.into_iter().map(|(node, _)| node).take(copies - 1);
    Holders::Only([own].into_iter().chain(others).cloned().collect())
}

/// True once a node knows of the others what it takes to choose `copies` holders of a map: which of those it heard of
/// are live, and that no more will be heard of soon where they are fewer. A node that runs beats every two seconds, so
/// whoever has beaten as often as it takes to count another as gone has heard of all that run.
pub(super) fn knows_others(copies: usize, view: &View) -> bool {
    let live = view.others.values().filter(|seen| seen.is_live).count();
    view.is_settled && (live + 1 >= copies || view.beats >= OWN_BEATS)
}

#[cfg(test)]
mod tests {
    use uuid::Uuid;

    use super::*;
    use crate::beat::{Beat, MapHead};
    use crate::node::view::Seen;

    fn name(name: &str) -> NodeName {
        NodeName::new(name).unwrap()
    }

    /// What a node sees of others: name, whether it is live, bytes that are free, maps.
    fn view_of(others: &[(&str, bool, u64, usize)]) -> View {
        let head = MapHead {
            revision: 1,
            epoch: 1,
            claim: None,
            sequence: 1,
            leads: false,
            is_parted: false,
            agrees: true,
        };
        let seen = |&(node, is_live, free_bytes, maps): &(&str, bool, u64, usize)| {
            let beat = Beat {
                record_version: 1,
                maps: (0..maps).map(|map| (Uuid::from_u128(map as u128), head)).collect(),
                free_bytes,
                ..Beat::default()
            };
            (name(node), Seen { beat, revision: 1, is_live })
        };
        View { others: others.iter().map(seen).collect(), is_settled: true, ..View::default() }
    }

    /// What `own` holds a new map with, beside these others.
    fn chosen(copies: usize, others: &[(&str, bool, u64, usize)]) -> String {
        holders(copies, &name("own"), &view_of(others)).to_string()
    }

    #[test]
    fn a_node_that_was_just_started_waits_for_others_that_may_be_there() {
        let others = [("a", true, 5, 0), ("b", false, 5, 0)];
        let knows =
            |copies, beats, is_settled| knows_others(copies, &View { beats, is_settled, ..view_of(&others) });
        assert!(knows(1, 0, true) && knows(2, 0, true), "as many as hold it are live");
        assert!(!knows(3, OWN_BEATS - 1, true) && knows(3, OWN_BEATS, true), "no third has beaten by then");
        assert!(!knows(1, 100, false), "one that was heard of may be gone");
    }

    #[test]
    fn a_map_is_held_where_it_was_made_and_where_there_is_the_most_room() {
        let others = [("a", true, 5, 0), ("b", true, 9, 3), ("c", false, 99, 0), ("d", true, 7, 1)];
        assert_eq!(chosen(0, &others), "all");
        assert_eq!(chosen(1, &others), "own");
        assert_eq!(chosen(2, &others), "b,own");
        assert_eq!(chosen(3, &others), "b,d,own");
        assert_eq!(chosen(4, &others), "a,b,d,own");
    }

    #[test]
    fn of_nodes_with_equal_room_the_one_with_fewer_maps_is_taken_and_then_the_first_name() {
        assert_eq!(chosen(2, &[("a", true, 5, 2), ("b", true, 5, 1), ("c", true, 5, 1)]), "b,own");
        assert_eq!(chosen(3, &[("a", true, 5, 2), ("b", true, 5, 1), ("c", true, 5, 1)]), "b,c,own");
    }

    #[test]
    fn where_fewer_nodes_are_live_fewer_hold_it() {
        assert_eq!(chosen(3, &[]), "own");
        assert_eq!(chosen(3, &[("a", false, 5, 0), ("b", true, 0, 0)]), "b,own");
    }
}
