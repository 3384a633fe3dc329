//! Many histories.

use super::history::{History, Violation};
use crate::replication::Rule;

fn histories() -> u64 {
    std::env::var("MROL_HISTORIES").map_or(8_000, |text| text.parse().unwrap())
}

#[test]
fn nothing_acknowledged_is_lost_and_nothing_is_made_twice() {
    let one = std::env::var("MROL_HISTORY").ok().map(|text| text.parse::<u64>().unwrap());
    let seeds = one.map_or(0..histories(), |seed| seed..seed + 1);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let run = &|first: usize| {
        for seed in seeds.clone().skip(first).step_by(threads) {
            if let Err(Violation(what)) = History::new(seed, None).run() {
                panic!("history {seed}: {what}");
            }
        }
    };
    std::thread::scope(|scope| (0..threads).for_each(|first| drop(scope.spawn(move || run(first)))));
}

#[test]
fn a_node_that_leaves_out_a_rule_is_found_out() {
    for rule in [Rule::OwnEpoch, Rule::Position, Rule::CaughtUp, Rule::SameId, Rule::FreshHeads] {
        let found = (0..histories())
            .find_map(|seed| History::new(seed, Some(rule)).run().err().map(|Violation(what)| (seed, what)));
        let (seed, what) = found.unwrap_or_else(|| panic!("{rule:?} is left out, and no history shows it"));
        println!("without {rule:?}: history {seed}: {what}");
    }
}

#[test]
fn where_two_faults_part_histories_it_is_told() {
    for seed in 0..histories() / 3 {
        if let Err(Violation(what)) = History::of_two_faults(seed, seed % 2 == 1).run() {
            panic!("history {seed}: {what}");
        }
    }
}
