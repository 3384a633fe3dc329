//! Who is to lead a map.
//!
//! `choose` is the whole of it; `claiming` says whether a node claims to lead, `opening` when one that has claimed takes
//! over, and `handing` to whom one that leads gives the lead.

mod claiming;
mod handing;
mod opening;
#[cfg(test)]
mod tests;

use mrol_service::Lead;
use mrol_service::replication::NodeName;
use uuid::Uuid;

use self::claiming::{is_first, is_led_elsewhere, is_read_by_all, may_claim, must_give_back};
use self::handing::successor;
use self::opening::{all_have_heard, furthest};
use super::view::View;
use crate::catalog::Placement;

/// What a node does about the lead of a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Choice {
    /// Nothing.
    Stay,
    /// It claims to lead.
    Claim,
    /// It takes over by its claim of this id.
    Open(Option<Uuid>),
    /// It gives the lead to another.
    HandOver(NodeName),
}

/// What a node knows of a map when it chooses.
#[derive(Debug, Clone)]
pub(super) struct Known<'a> {
    /// The node itself.
    pub(super) own: &'a NodeName,
    /// The map.
    pub(super) map: Uuid,
    /// Revision of its own copy.
    pub(super) revision: u64,
    /// Number of the last message of the log that it had read a beat ago.
    pub(super) sequence_before: u64,
    /// Who leads, as far as it has read the log.
    pub(super) lead: &'a Lead,
    /// Which nodes hold the map, and which of them is to lead whenever it can.
    pub(super) placement: &'a Placement,
    /// The others.
    pub(super) view: &'a View,
    /// Its own beats since it has seen no node lead the map, and no new claim of another.
    pub(super) waited: u64,
    /// A revision of the beats' bucket after its last claim of the map, once there is one.
    pub(super) claimed_at: Option<u64>,
    /// Version of the records that it writes.
    pub(super) record_version: u32,
}

/// What a node does about the lead of a map. Whatever it chooses is safe: two nodes that claim at once are told apart
/// by the log. It is made so that one claims as a rule, and soon. A node that is to hold the map no more leads
/// until a holder can take over.
pub(super) fn choose(known: &Known<'_>) -> Choice {
    match known.lead {
        Lead::Shared { is_here: true, .. } => match successor(known) {
            Some(node) => Choice::HandOver(node.clone()),
            None => Choice::Stay,
        },
        // Before it has seen the others, it does not know what they read; unheard, it may not be alone of its name.
        _ if known.view.beats == 0 || known.view.is_unheard => Choice::Stay,
        Lead::Shared { has_claimed: true, claim, .. } => match furthest(known) {
            Some(node) => Choice::HandOver(node.clone()),
            None if all_have_heard(known, *claim) => Choice::Open(*claim),
            None => Choice::Stay,
        },
        // It would be refused.
        Lead::Shared { agrees: false, .. } => Choice::Stay,
        Lead::Shared { leader, .. } if is_led_elsewhere(known, leader.as_ref()) => Choice::Stay,
        Lead::Shared { leader, .. } if !may_claim(known, leader.as_ref()) => Choice::Stay,
        // What it would write, not all could read: nodes are exchanged one by one.
        Lead::Shared { leader, .. } if !is_read_by_all(known) && !must_give_back(known, leader.as_ref()) => {
            Choice::Stay
        }
        Lead::Shared { leader, .. } if is_first(known, leader.as_ref()) => Choice::Claim,
        _ => Choice::Stay,
    }
}
