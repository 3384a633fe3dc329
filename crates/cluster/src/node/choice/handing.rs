//! To which node one that leads gives the lead.

use mrol_service::replication::NodeName;

use super::known::Known;
use crate::beat::MapHead;
use crate::catalog::Placement;

/// The node to which this one, which leads, gives the lead: the holder that is wished, and where this one is to hold
/// the map no more, or writes what a live node cannot read, any holder whose records all can read, the furthest first.
pub(super) fn successor<'a>(known: &Known<'a>) -> Option<&'a NodeName> {
    let Known { view, map, .. } = *known;
    let Placement { holders, leader: wished } = known.placement;
    let read_by_all = view.reads_least(map, holders).min(known.record_version);
    let may_lead = |node: &NodeName| {
        holders.contains(node) && view.writes(node) <= read_by_all && can_take_over(known, node)
    };
    let able = view.holders(map).filter(|(node, _)| may_lead(node));
    let may_go_on = holders.contains(known.own) && read_by_all == known.record_version;
    let rank = |(node, head): &(&NodeName, &MapHead)| {
        (wished.as_ref() == Some(*node), head.sequence, std::cmp::Reverse((*node).clone()))
    };
    let first = able.max_by_key(rank).map(|(node, _)| node);
    first.filter(|node| !may_go_on || wished.as_ref() == Some(*node))
}

/// True of another node that has read what this one had a beat ago.
fn can_take_over(known: &Known<'_>, node: &NodeName) -> bool {
    let mut holders = known.view.holders(known.map);
    holders.any(|(holder, head)| holder == node && head.sequence >= known.sequence_before)
}
