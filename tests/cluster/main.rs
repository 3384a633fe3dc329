//! Nodes and servers of NATS, each a process of its own, are killed, stopped, cut off, filled up and put back to older
//! copies, while four writers write and a reader reads at each node. Every change that was acknowledged is there once,
//! and all nodes are equal.
//!
//! ```text
//! NATS_SERVER_PROGRAM=$(.ci/nats-server) cargo test --test cluster
//! MROL_CLUSTER_ROUNDS=100 NATS_SERVER_PROGRAM=$(.ci/nats-server) cargo test --release --test cluster -- --nocapture
//! ```

#![cfg(all(feature = "cluster", target_os = "linux"))]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod copies;
mod faults;
mod figures;
mod large;
mod link;
mod load;
mod lost_nats;
#[expect(dead_code, reason = "the tests of the log use more of it")]
mod nats;
mod released;
mod site;
mod watches;

use std::sync::Arc;
use std::time::{Duration, Instant};

use mrol::map::MapName;
use parking_lot::Mutex;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::faults::{FAULTS, Fault, Report};
use crate::load::{Load, Reads};
use crate::site::{MapState, NODES, Site, WITHIN};

/// Faults at random of the long form; 0 = each once, in order.
fn rounds() -> usize {
    std::env::var("MROL_CLUSTER_ROUNDS").map_or(0, |text| text.parse().expect("a number"))
}

/// The fault that happens again and again, where one alone is looked for.
fn only() -> Option<Fault> {
    let name = std::env::var("MROL_CLUSTER_FAULT").ok()?;
    Some(FAULTS.into_iter().find(|fault| format!("{fault:?}") == name).expect("the name of a fault"))
}

/// Where faults at random begin.
fn seed() -> u64 {
    std::env::var("MROL_CLUSTER_SEED").map_or(1, |text| text.parse().expect("a number"))
}

/// A time without an acknowledgment that nodes are asked about.
const LONG: Duration = Duration::from_secs(20);
/// How long the long form reads before anything fails.
const CALM: Duration = Duration::from_secs(20);
/// The tests take the whole machine, one after the other.
static TURN: Mutex<()> = Mutex::new(());

#[test]
fn no_acknowledged_change_is_lost_or_made_twice_whatever_fails() {
    let _turn = TURN.lock();
    let Some(mut site) = Site::start() else { return };
    if rounds() > 0 {
        read_without_faults(&site);
    }
    let map = MapName::new("hall").unwrap();
    site.create(&map);
    let load = Load::begin(&site, &map);
    let began = Instant::now();
    load.wait_for(20);
    let mut report = Report::default();
    let mut random = StdRng::seed_from_u64(seed());
    let faults: Vec<Fault> = match rounds() {
        0 => FAULTS.to_vec(),
        rounds => {
            let any = |random: &mut StdRng| FAULTS[random.random_range(0..FAULTS.len())];
            (0..rounds).map(|_| only().unwrap_or_else(|| any(&mut random))).collect()
        }
    };
    for (round, fault) in faults.iter().enumerate() {
        let begun = Instant::now();
        println!("{round}, at {:.3} s: {fault:?}", began.elapsed().as_secs_f64());
        fault.happen(&mut site, &load, &map);
        load.wait_for(10);
        let gap = load.longest_gap(begun);
        if gap > LONG {
            println!("no acknowledgment for {gap:?}:");
            site.print_logs();
        }
        report.note(*fault, gap);
    }
    let (scans, readers) = load.end(&site);
    check_equal(&site, &map, scans);
    report.print();
    for failed in print_reads(&readers) {
        assert!(failed.len() <= 5, "reads failed at a node that was up: {failed:#?}");
    }
    println!("{scans} scans, each once");
}

/// Says how long reads take under the same load while nothing fails.
fn read_without_faults(site: &Site) {
    let map = MapName::new("calm").unwrap();
    site.create(&map);
    let load = Load::begin(site, &map);
    std::thread::sleep(CALM);
    println!("without faults, {} s:", CALM.as_secs());
    print_reads(&load.end(site).1);
}

/// Says how long reads took; what failed, node by node.
fn print_reads(readers: &[Arc<Reads>]) -> Vec<Vec<String>> {
    let mut all_failed = Vec::new();
    for (node, reads) in readers.iter().enumerate() {
        let (failed, answered, slow) = reads.summary();
        println!("reads at node {node}: {answered}, of which 99 % within {slow:?}; {} failed", failed.len());
        all_failed.push(failed);
    }
    all_failed
}

/// All nodes are at one revision with one content, and every scan that was acknowledged is there once.
#[track_caller]
fn check_equal(site: &Site, map: &MapName, scans: usize) {
    let begun = Instant::now();
    loop {
        let states: Vec<Option<MapState>> = (0..NODES).map(|node| site.state(node, map)).collect();
        let is_all = |state: &MapState| state.scans == scans && state.voxels == scans;
        if states[0].as_ref().is_some_and(is_all) && states.iter().all(|state| *state == states[0]) {
            return;
        }
        assert!(begun.elapsed() < WITHIN, "{states:?} after {scans} scans");
        std::thread::sleep(Duration::from_millis(100));
    }
}
