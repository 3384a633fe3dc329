//! When a node that has claimed takes over.

use mrol_service::replication::NodeName;
use uuid::Uuid;

use super::known::Known;
use crate::beat::MapHead;

/// The live node that is furthest and could take over, where that is further than this one.
pub(super) fn furthest<'a>(known: &Known<'a>) -> Option<&'a NodeName> {
    let further =
        known.view.holders(known.map).filter(|(_, head)| head.agrees && head.revision > known.revision);
    further.max_by_key(|(_, head)| head.revision).map(|(node, _)| node)
}

/// True where every other live node has said how far it is since this one made its `claim`: it had read it, or beat
/// later than this node after the claim. What it said before is no measure: the log may have lost its newest messages
/// since. Nor is it that it said nothing of the map: it may have taken its copy since. One whose copy is further and
/// has not joined its log since that node was started is waited for: it may be the only one that has what the log has
/// lost.
pub(super) fn all_have_heard(known: &Known<'_>, claim: Option<Uuid>) -> bool {
    let holders = &known.placement.holders;
    known.view.others.iter().filter(|(_, seen)| seen.is_live).all(|(node, seen)| {
        // It changes only once it has joined its log, and then goes no further than this node has read.
        if let Some(revision) = seen.beat.unjoined.get(&known.map) {
            return *revision <= known.revision;
        }
        let head = seen.beat.maps.get(&known.map);
        if head.is_none() && !holders.contains(node) {
            return true;
        }
        let has_read = |head: &MapHead| head.is_parted || (claim.is_some() && head.claim == claim);
        head.is_some_and(has_read) || known.claimed_at.is_some_and(|claimed| seen.revision > claimed)
    })
}
