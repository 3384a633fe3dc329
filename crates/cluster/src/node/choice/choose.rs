//! What a node does about the lead of a map.

use mrol_service::Lead;

use super::claiming::{is_first, is_led_elsewhere, is_read_by_all, may_claim, must_give_back};
use super::handing::successor;
use super::known::{Choice, Known};
use super::opening::{all_have_heard, furthest};

/// What a node does about the lead of a map. Whatever it chooses is safe: two nodes that claim at once are told apart
/// by the log. It is made so that one claims as a rule, and soon. A node that is to hold the map no more leads
/// until a holder can take over.
pub(in crate::node) fn choose(known: &Known<'_>) -> Choice {
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
        // Nodes that were just started, as this one, may have more: they are waited for until they beat, or are gone.
        _ if !known.view.is_settled => Choice::Stay,
        Lead::Shared { leader, .. } if is_first(known, leader.as_ref()) => Choice::Claim,
        _ => Choice::Stay,
    }
}
