//! What a node chooses.

use std::collections::BTreeMap;

use mrol_service::Lead;
use mrol_service::replication::NodeName;
use uuid::Uuid;

use super::claiming::PATIENCE;
use super::{Choice, Known, choose};
use crate::beat::{Beat, MapHead};
use crate::catalog::{Holders, Placement};
use crate::node::view::{Seen, View};

const MAP: Uuid = Uuid::from_u128(1);

fn node(name: &str) -> NodeName {
    NodeName::new(name).unwrap()
}

/// Other nodes: name, whether it is live, the revision of its copy if it has one, whether that is parted.
fn view(others: &[(&str, bool, Option<u64>, bool)]) -> View {
    let seen = |&(name, is_live, revision, is_parted): &(&str, bool, Option<u64>, bool)| {
        let head = |revision| {
            let head = MapHead {
                revision,
                epoch: 1,
                claim: Some(Uuid::from_u128(1)),
                sequence: revision,
                leads: !is_parted,
                is_parted,
                agrees: true,
            };
            (MAP, head)
        };
        let beat =
            Beat { record_version: 7, maps: revision.map(head).into_iter().collect(), ..Beat::default() };
        (node(name), Seen { beat, revision: 20, is_live })
    };
    let others = others.iter().map(seen).collect::<BTreeMap<_, _>>();
    View { beats: 10, is_settled: true, others, ..View::default() }
}

fn led_by(leader: Option<&str>, is_here: bool) -> Lead {
    Lead::Shared {
        leader: leader.map(node),
        is_here,
        has_claimed: is_here,
        epoch: 1,
        claim: None,
        sequence: 5,
        agrees: true,
    }
}

/// `b` has made this claim, and has not taken over.
fn claimed_by_b(claim: u128) -> Lead {
    Lead::Shared {
        leader: Some(node("b")),
        is_here: false,
        has_claimed: true,
        epoch: 1,
        claim: Some(Uuid::from_u128(claim)),
        sequence: 5,
        agrees: true,
    }
}

/// What `b` at revision 5 does.
fn chosen(
    lead: &Lead,
    others: &[(&str, bool, Option<u64>, bool)],
    waited: u64,
    wished: Option<&str>,
) -> Choice {
    chosen_of(Holders::All, lead, others, waited, wished)
}

/// The same, of a map that these nodes hold.
fn chosen_of(
    holders: Holders,
    lead: &Lead,
    others: &[(&str, bool, Option<u64>, bool)],
    waited: u64,
    wished: Option<&str>,
) -> Choice {
    let (own, view) = (node("b"), view(others));
    let placement = Placement { holders, leader: wished.map(node) };
    let (placement, view) = (&placement, &view);
    let known = Known {
        own: &own,
        map: MAP,
        revision: 5,
        sequence_before: 5,
        lead,
        placement,
        view,
        waited,
        claimed_at: None,
        record_version: 7,
    };
    choose(&known)
}

#[test]
fn who_leads_goes_on_and_who_sees_a_leader_follows() {
    assert_eq!(chosen(&led_by(Some("b"), true), &[("a", true, Some(9), false)], 9, None), Choice::Stay);
    assert_eq!(chosen(&led_by(Some("a"), false), &[("a", true, Some(4), false)], 9, None), Choice::Stay);
    assert_eq!(chosen(&Lead::NotJoined, &[], 9, None), Choice::Stay);
    assert_eq!(chosen(&Lead::Alone, &[], 9, None), Choice::Stay);
}

#[test]
fn of_a_leader_that_is_gone_the_furthest_takes_over_and_of_equals_the_first_name() {
    let gone = ("a", false, Some(5), false);
    let lead = led_by(Some("a"), false);
    assert_eq!(chosen(&lead, &[gone, ("c", true, Some(5), false)], 0, None), Choice::Claim);
    assert_eq!(chosen(&lead, &[gone, ("c", true, Some(6), false)], 0, None), Choice::Stay);
    assert_eq!(chosen(&lead, &[gone, ("c", true, Some(5), false)], 0, Some("c")), Choice::Stay);
    assert_eq!(chosen(&lead, &[gone, ("aa", true, Some(5), false)], 0, None), Choice::Stay);
    // It does not come.
    assert_eq!(chosen(&lead, &[gone, ("aa", true, Some(5), false)], PATIENCE, None), Choice::Claim);
    assert_eq!(chosen(&lead, &[gone, ("aa", true, Some(6), false)], PATIENCE, None), Choice::Stay);
    // One that is gone, or has parted, counts for nothing.
    assert_eq!(chosen(&lead, &[gone, ("aa", false, Some(9), false)], 0, None), Choice::Claim);
    assert_eq!(chosen(&lead, &[gone, ("aa", true, Some(9), true)], 0, None), Choice::Claim);
}

#[test]
fn a_leader_that_is_back_without_its_copy_is_waited_for_and_not_for_ever() {
    let lead = led_by(Some("a"), false);
    assert_eq!(chosen(&lead, &[("a", true, None, false)], 0, None), Choice::Stay);
    assert_eq!(chosen(&lead, &[("a", true, None, false)], PATIENCE, None), Choice::Claim);
    assert_eq!(chosen(&lead, &[("a", true, Some(5), true)], PATIENCE, None), Choice::Claim);
}

/// What `b` at revision 5 does, which writes records of a newer version than the others, or the same.
fn chosen_by(record_version: u32, lead: &Lead, view: &View, wished: Option<&str>) -> Choice {
    let (own, wished) = (node("b"), wished.map(node));
    let (map, revision, sequence_before, waited) = (MAP, 5, 5, PATIENCE);
    choose(&Known {
        own: &own,
        map,
        revision,
        sequence_before,
        lead,
        placement: &Placement { holders: Holders::All, leader: wished },
        view,
        waited,
        claimed_at: None,
        record_version,
    })
}

#[test]
fn who_writes_what_another_cannot_read_does_not_take_over() {
    let gone = ("a", false, Some(5), false);
    let lead = led_by(Some("a"), false);
    let by = |record_version, others: &View| chosen_by(record_version, &lead, others, None);
    let others = view(&[gone, ("c", true, Some(5), false)]);
    assert_eq!(by(7, &others), Choice::Claim);
    assert_eq!(by(8, &others), Choice::Stay);
    assert_eq!(by(8, &view(&[gone, ("c", true, None, false)])), Choice::Stay, "it is loading the map");
    assert_eq!(by(8, &view(&[gone, ("c", true, Some(5), true)])), Choice::Claim, "it has parted already");
    let unseen = View { beats: 0, ..view(&[]) };
    assert_eq!(by(8, &unseen), Choice::Stay, "who is there is not known yet");
    let unheard = View { is_unheard: true, ..view(&[gone]) };
    assert_eq!(by(7, &unheard), Choice::Stay, "another process may have its name");
    let unsettled = View { is_settled: false, ..view(&[gone]) };
    assert_eq!(by(7, &unsettled), Choice::Stay, "others may be starting");
}

#[test]
fn who_writes_what_another_cannot_read_hands_over_to_one_that_all_can_read() {
    let lead = led_by(Some("b"), true);
    let older = |name, sequence, is_parted| (name, true, Some(sequence), is_parted);
    let others = view(&[older("a", 5, false), older("c", 6, false)]);
    assert_eq!(chosen_by(7, &lead, &others, None), Choice::Stay);
    assert_eq!(chosen_by(8, &lead, &others, None), Choice::HandOver(node("c")), "it is furthest");
    assert_eq!(chosen_by(8, &lead, &others, Some("a")), Choice::HandOver(node("a")));
    assert_eq!(chosen_by(8, &lead, &view(&[older("a", 4, false)]), None), Choice::Stay, "it is behind");
    assert_eq!(chosen_by(8, &lead, &view(&[older("a", 5, true)]), None), Choice::Stay, "it has parted");
    // One that is wished, and that not all can read.
    let mut others = view(&[older("a", 5, false), older("c", 5, false)]);
    others.others.get_mut(&node("c")).unwrap().beat.record_version = 8;
    assert_eq!(chosen_by(8, &lead, &others, Some("c")), Choice::HandOver(node("a")));
    assert_eq!(chosen_by(7, &lead, &others, Some("c")), Choice::Stay);
}

#[test]
fn who_leads_by_the_log_and_was_started_again_takes_over_before_others() {
    let lead = led_by(Some("b"), false);
    assert_eq!(chosen(&lead, &[("a", true, Some(5), false)], 0, Some("a")), Choice::Claim);
    assert_eq!(chosen(&lead, &[("a", true, Some(7), false)], 0, None), Choice::Stay);
}

#[test]
fn what_was_claimed_is_opened_once_all_have_said_how_far_they_are_since() {
    let own = node("b");
    let then = |claim, claimed_at, others: &[(&str, bool, Option<u64>, bool)]| {
        let (lead, view) = (claimed_by_b(claim), view(others));
        let known = Known {
            own: &own,
            map: MAP,
            revision: 5,
            sequence_before: 5,
            lead: &lead,
            placement: &Placement { holders: Holders::All, leader: None },
            view: &view,
            waited: 0,
            claimed_at,
            record_version: 7,
        };
        choose(&known)
    };
    // All beats here are of nodes that have read claim 1, and have revision 20 of the bucket.
    let [behind, equal, further] = [4, 5, 6].map(|revision| ("a", true, Some(revision), false));
    assert_eq!(then(1, None, &[behind]), Choice::Open(Some(Uuid::from_u128(1))));
    assert_eq!(then(2, None, &[equal]), Choice::Stay, "it has not read the claim");
    assert_eq!(then(2, Some(20), &[equal]), Choice::Stay, "its beat is older");
    assert_eq!(
        then(2, Some(19), &[equal]),
        Choice::Open(Some(Uuid::from_u128(2))),
        "it does not follow, and beat since"
    );
    let copying = ("c", true, None, false);
    assert_eq!(then(1, None, &[equal, copying]), Choice::Stay, "c may have a copy by now");
    assert_eq!(then(1, Some(19), &[equal, copying]), Choice::Open(Some(Uuid::from_u128(1))));
    assert_eq!(
        then(2, None, &[("a", false, Some(5), false)]),
        Choice::Open(Some(Uuid::from_u128(2))),
        "a is gone"
    );
    assert_eq!(
        then(2, None, &[("a", true, Some(9), true)]),
        Choice::Open(Some(Uuid::from_u128(2))),
        "a has parted"
    );
    assert_eq!(then(2, None, &[further]), Choice::HandOver(node("a")));
}

#[test]
fn a_copy_that_has_not_joined_its_log_and_is_further_is_waited_for() {
    let then = |unjoined: u64| {
        let lead = claimed_by_b(1);
        let mut others = view(&[("a", true, None, false)]);
        others.others.get_mut(&node("a")).unwrap().beat.unjoined.insert(MAP, unjoined);
        let (own, placement) = (node("b"), Placement { holders: Holders::All, leader: None });
        choose(&Known {
            own: &own,
            map: MAP,
            revision: 5,
            sequence_before: 5,
            lead: &lead,
            placement: &placement,
            view: &others,
            waited: PATIENCE,
            claimed_at: Some(19),
            record_version: 7,
        })
    };
    assert_eq!(then(6), Choice::Stay, "it may have what the log has lost");
    assert_eq!(then(5), Choice::Open(Some(Uuid::from_u128(1))));
}

#[test]
fn who_was_given_the_lead_and_alone_has_what_the_log_lost_gives_it_back_whoever_can_read_it() {
    let by = |leader, others: u64| {
        let others = view(&[("a", true, Some(others), false)]);
        chosen_by(8, &led_by(Some(leader), false), &others, None)
    };
    assert_eq!(by("b", 4), Choice::Claim);
    assert_eq!(by("b", 5), Choice::Stay, "a has it too");
    assert_eq!(by("c", 4), Choice::Stay, "it was not given the lead");
}

#[test]
fn who_cannot_tell_its_history_claims_nothing_and_is_given_nothing() {
    let unsure = Lead::Shared {
        leader: None,
        is_here: false,
        has_claimed: false,
        epoch: 1,
        claim: None,
        sequence: 5,
        agrees: false,
    };
    assert_eq!(chosen(&unsure, &[], PATIENCE, None), Choice::Stay);
    let claimed = claimed_by_b(1);
    let mut others = view(&[("a", true, Some(9), false)]);
    let by = |others: &View, lead: &Lead| chosen_by(7, lead, others, None);
    assert_eq!(by(&others, &claimed), Choice::HandOver(node("a")));
    others.others.get_mut(&node("a")).unwrap().beat.maps.get_mut(&MAP).unwrap().agrees = false;
    assert_ne!(by(&others, &claimed), Choice::HandOver(node("a")));
    assert_eq!(by(&others, &led_by(None, false)), Choice::Stay, "it may have what others acknowledged");
}

#[test]
fn a_map_that_nobody_led_yet_is_claimed() {
    assert_eq!(chosen(&led_by(None, false), &[], 0, None), Choice::Claim);
}

#[test]
fn who_is_no_holder_claims_nothing_and_gives_the_lead_to_a_holder_that_has_followed() {
    let chosen = |holders: &[&str], lead: &Lead, others: &[(&str, bool, Option<u64>, bool)], wished| {
        chosen_of(Holders::Only(holders.iter().map(|name| node(name)).collect()), lead, others, 9, wished)
    };
    let (led, followed) = (led_by(Some("b"), true), led_by(Some("b"), false));
    let gone = [("a", false, Some(5), false)];
    let there = [("a", false, Some(5), false), ("c", true, Some(4), false)];
    assert_eq!(chosen(&["a", "c"], &led_by(Some("a"), false), &there, None), Choice::Stay);
    assert_eq!(
        chosen(&["a", "c"], &led_by(Some("a"), false), &gone, None),
        Choice::Claim,
        "no live holder has a copy"
    );
    assert_eq!(
        chosen(&["a", "c"], &followed, &gone, None),
        Choice::Claim,
        "it is named, and has what there is"
    );
    assert_eq!(chosen(&["b", "c"], &followed, &[], None), Choice::Claim);
    let both = [("a", true, Some(5), false), ("c", true, Some(5), false)];
    assert_eq!(chosen(&["a", "c"], &led, &both, None), Choice::HandOver(node("a")));
    assert_eq!(chosen(&["a", "c"], &led, &both, Some("c")), Choice::HandOver(node("c")));
    assert_eq!(chosen(&["c"], &led, &both, None), Choice::HandOver(node("c")));
    assert_eq!(chosen(&["c"], &led, &both[..1], None), Choice::Stay, "its holder has no copy yet");
    assert_eq!(chosen(&["c"], &led, &[("c", true, Some(4), false)], None), Choice::Stay, "it is behind");
    assert_eq!(
        chosen(&["b", "c"], &led, &both, Some("a")),
        Choice::Stay,
        "the one that is wished holds none"
    );
}

#[test]
fn a_copy_that_is_about_to_go_is_not_waited_for_and_what_it_has_counts() {
    let of = |leaving: u64| {
        let holders = Holders::Only([node("b")].into());
        chosen_of(holders, &led_by(None, false), &[("a", true, Some(leaving), false)], 0, None)
    };
    assert_eq!(of(5), Choice::Claim, "the first name does not count");
    assert_eq!(of(6), Choice::Stay, "it would lose what only that one has");
}

#[test]
fn the_lead_goes_to_the_node_that_is_wished_once_that_has_followed() {
    let lead = led_by(Some("b"), true);
    let to = |others: &[(&str, bool, Option<u64>, bool)]| chosen(&lead, others, 0, Some("c"));
    assert_eq!(to(&[("c", true, Some(5), false)]), Choice::HandOver(node("c")));
    assert_eq!(to(&[("c", true, Some(4), false)]), Choice::Stay, "it is behind");
    assert_eq!(to(&[("c", false, Some(5), false)]), Choice::Stay, "it is gone");
    assert_eq!(to(&[("c", true, Some(5), true)]), Choice::Stay, "it has parted");
    assert_eq!(to(&[("c", true, None, false)]), Choice::Stay, "it has no copy");
}
