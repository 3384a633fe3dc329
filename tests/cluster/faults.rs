//! What may happen to a site.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

use mrol::map::MapName;

use crate::load::Load;
use crate::nats::skipped::skipped;
use crate::site::{NODES, Site, SmallDisk};

/// What may happen to a site. Each is over when it has happened: all run again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Fault {
    LeaderKilled,
    FollowerKilled,
    LeaderEnded,
    LeaderStopped,
    LeaderCutOff,
    NatsKilled,
    NatsStopped,
    QuorumLost,
    AllKilled,
    NatsPutBack,
    FolderWiped,
    NodeDiskFull,
    NatsDiskFull,
}

/// All of them, as the short form has them happen: those that need a clean site first.
pub(crate) const FAULTS: [Fault; 13] = [
    Fault::LeaderKilled,
    Fault::LeaderEnded,
    Fault::NatsKilled,
    Fault::FollowerKilled,
    Fault::LeaderStopped,
    Fault::FolderWiped,
    Fault::LeaderCutOff,
    Fault::NatsStopped,
    Fault::QuorumLost,
    Fault::NodeDiskFull,
    Fault::NatsDiskFull,
    Fault::AllKilled,
    Fault::NatsPutBack,
];

/// How long a process is stopped or cut off: longer than others wait until it counts as gone.
const STOPPED: Duration = Duration::from_secs(12);

impl Fault {
    pub(crate) fn happen(self, site: &mut Site, load: &Load, map: &MapName) {
        let leader = site.leader(map);
        let follower = (leader + 1) % NODES;
        match self {
            Self::LeaderKilled => restart(site, load, leader, Site::kill_node),
            Self::FollowerKilled => restart(site, load, follower, Site::kill_node),
            Self::LeaderEnded => restart(site, load, leader, Site::end_node),
            Self::FolderWiped => restart(site, load, follower, |site, node| {
                site.kill_node(node);
                fs::remove_dir_all(site.data(node)).unwrap();
            }),
            Self::LeaderStopped => {
                load.set_up(leader, false);
                site.signal(leader, "STOP");
                sleep(STOPPED);
                site.signal(leader, "CONT");
                settled(site, load, leader);
            }
            Self::LeaderCutOff => {
                site.cut_off(leader);
                sleep(STOPPED);
                site.mend(leader);
                settled(site, load, leader);
            }
            Self::NatsKilled => {
                site.nats.kill(leader);
                load.wait_for(5);
                site.nats.start_one(leader);
                nats_settled(site);
            }
            Self::NatsStopped => {
                site.nats.signal(leader, "STOP");
                sleep(STOPPED);
                site.nats.signal(leader, "CONT");
                nats_settled(site);
            }
            Self::QuorumLost => {
                site.nats.kill(0);
                site.nats.kill(1);
                sleep(Duration::from_secs(5));
                site.nats.start_all();
                nats_settled(site);
            }
            Self::AllKilled => {
                (0..NODES).for_each(|node| load.set_up(node, false));
                (0..NODES).for_each(|node| site.kill_node(node));
                site.nats.kill_all();
                site.nats.start_all();
                (0..NODES).for_each(|node| site.start_node(node));
                (0..NODES).for_each(|node| settled(site, load, node));
            }
            Self::NatsPutBack => {
                site.nats.kill_all();
                let older = site.nats.copy_stores();
                site.nats.start_all();
                load.wait_for(20);
                // All that was acknowledged is at each node: what no node has is lost with the stores.
                let copied = |site: &Site| (0..NODES).map(|node| site.state(node, map)).collect::<Vec<_>>();
                assert!(copied(site).iter().all(Option::is_some));
                site.nats.kill_all();
                site.nats.put_back_stores(&older);
                site.nats.start_all();
                nats_settled(site);
            }
            Self::NodeDiskFull => node_disk_full(site, load, follower),
            Self::NatsDiskFull => nats_disk_full(site, load, leader),
        }
    }
}

/// A node is gone, and is started again once the others have gone on without it.
fn restart(site: &mut Site, load: &Load, node: usize, end: impl Fn(&mut Site, usize)) {
    load.set_up(node, false);
    end(site, node);
    load.wait_for(10);
    site.start_node(node);
    settled(site, load, node);
}

/// Waits until a node has joined, and has all that the others have.
fn settled(site: &Site, load: &Load, node: usize) {
    site.wait_until_ready(node);
    load.set_up(node, true);
}

/// Waits until the servers of NATS have all that is to be had.
fn nats_settled(site: &Site) {
    let begun = Instant::now();
    while !(0..NODES).all(|server| site.nats.is_current(server)) {
        assert!(begun.elapsed() < crate::site::WITHIN, "a server of NATS does not catch up");
        sleep(Duration::from_millis(100));
    }
}

/// The disk of a follower is full for a while. It goes on answering, and follows again once there is room.
fn node_disk_full(site: &mut Site, load: &Load, node: usize) {
    load.set_up(node, false);
    site.kill_node(node);
    let data = site.data(node);
    fs::remove_dir_all(&data).unwrap();
    let Some(disk) = SmallDisk::over(&data, 64) else {
        skipped("a full disk of a node (mounting takes root)");
        site.start_node(node);
        return settled(site, load, node);
    };
    site.start_node(node);
    settled(site, load, node);
    // The one that leads takes nothing that this node has no room for, and says so; it does once there is room.
    disk.fill_but(3);
    load.wait_until_refused(&format!("node n{node}"));
    disk.free();
    load.wait_for(100);
    // At once: its copy takes part no more, or it is waited for.
    disk.fill();
    sleep(Duration::from_secs(3));
    disk.free();
    load.wait_for(100);
    // What was not kept may need a new beginning.
    restart(site, load, node, Site::kill_node);
    load.set_up(node, false);
    site.kill_node(node);
    drop(disk);
    site.start_node(node);
    settled(site, load, node);
}

/// The disk of a server of NATS is full for a while.
fn nats_disk_full(site: &mut Site, load: &Load, server: usize) {
    site.nats.kill(server);
    let store = site.nats.store(server);
    // It has to take what the others have.
    let megabytes = 64 + 2 * (bytes_in(&store) >> 20) as u32;
    fs::remove_dir_all(&store).unwrap();
    let Some(disk) = SmallDisk::over(&store, megabytes) else {
        skipped("a full disk of a server of NATS (mounting takes root)");
        site.nats.start_one(server);
        return nats_settled(site);
    };
    site.nats.start_one(server);
    nats_settled(site);
    disk.fill();
    load.wait_for(100);
    disk.free();
    site.nats.kill(server);
    drop(disk);
    site.nats.start_one(server);
    nats_settled(site);
}

/// Bytes of the files of a folder, however deep.
fn bytes_in(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let bytes = entries.map(|entry| match entry.metadata().unwrap() {
        of_folder if of_folder.is_dir() => bytes_in(&entry.path()),
        of_file => of_file.len(),
    });
    bytes.sum()
}

/// How long writers were not acknowledged, by what happened.
#[derive(Default)]
pub(crate) struct Report(BTreeMap<Fault, Vec<Duration>>);

impl Report {
    pub(crate) fn note(&mut self, fault: Fault, gap: Duration) {
        self.0.entry(fault).or_default().push(gap);
    }

    pub(crate) fn print(mut self) {
        println!("{:>18} {:>6} {:>12} {:>12}", "what", "times", "median gap", "longest");
        for (fault, gaps) in &mut self.0 {
            gaps.sort();
            let (median, longest) = (gaps[gaps.len() / 2], gaps[gaps.len() - 1]);
            let fault = format!("{fault:?}");
            println!(
                "{fault:>18} {:>6} {:>10.2} s {:>10.2} s",
                gaps.len(),
                median.as_secs_f64(),
                longest.as_secs_f64()
            );
        }
    }
}
