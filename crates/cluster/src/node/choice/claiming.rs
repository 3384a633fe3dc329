//! Whether a node claims to lead a map.

use mrol_service::replication::NodeName;

use super::known::Known;
use crate::catalog::Placement;

/// Beats for which a node that does not lead what it should is waited for: it may be starting, or another may be better
/// placed.
pub(super) const PATIENCE: u64 = 4;

/// True of a holder. One that is to hold the map no more takes what it is given, since it has what the holders have
/// not, and what no live holder has a copy of.
pub(super) fn may_claim(known: &Known<'_>, leader: Option<&NodeName>) -> bool {
    let holders = &known.placement.holders;
    holders.contains(known.own)
        || leader == Some(known.own)
        || !known.view.holders(known.map).any(|(node, _)| holders.contains(node))
}

/// True where all others read what this node writes.
pub(super) fn is_read_by_all(known: &Known<'_>) -> bool {
    known.view.reads_least(known.map, &known.placement.holders) >= known.record_version
}

/// True of a node that was given the lead and alone has what the log has lost: it gives that back, and then the lead to
/// one whose records all can read.
pub(super) fn must_give_back(known: &Known<'_>, leader: Option<&NodeName>) -> bool {
    leader == Some(known.own) && known.view.holders(known.map).all(|(_, head)| head.revision < known.revision)
}

/// True where another node leads, or may be about to. One that the log names and that does not take over is not waited
/// for for ever: it may not be able to.
pub(super) fn is_led_elsewhere(known: &Known<'_>, leader: Option<&NodeName>) -> bool {
    let Some(leader) = leader.filter(|leader| *leader != known.own) else { return false };
    let leads = known.view.holders(known.map).any(|(node, head)| node == leader && head.leads);
    leads || (known.view.is_live(leader) && known.waited < PATIENCE)
}

/// True of the node that is furthest; of several holders, of the one that leads by the log, is wished, or has the first
/// name. Nodes that have a copy and are to hold the map no more do not claim; what they have counts.
pub(super) fn is_first(known: &Known<'_>, leader: Option<&NodeName>) -> bool {
    let Placement { holders, leader: wished } = known.placement;
    let rank = |node: &NodeName, revision: u64| {
        (revision, leader == Some(node), wished.as_ref() == Some(node), std::cmp::Reverse(node.clone()))
    };
    let own = rank(known.own, known.revision);
    // Whoever would have been first does not come where it was waited for long.
    let comes = |node: &NodeName| known.waited < PATIENCE && holders.contains(node);
    known.view.holders(known.map).all(|(node, head)| match comes(node) {
        true => rank(node, head.revision) < own,
        false => head.revision <= known.revision,
    })
}
