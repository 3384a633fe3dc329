//! All servers of NATS are lost with their disks: the nodes have the maps.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use mrol::geometry::Point;
use mrol::map::MapName;

use crate::site::{NODES, Site, WITHIN, program};

/// Puts one voxel more into a map.
fn insert(site: &Site, addresses: &str, map: &MapName, number: u64) {
    site.insert(addresses, map, number, Point::new(1.0 + number as f32, 0.0, 0.0));
}

/// Waits until a node has so many scans in a map.
fn wait_for(site: &Site, node: usize, map: &MapName, scans: usize) {
    let begun = Instant::now();
    while site.state(node, map).is_none_or(|state| (state.scans, state.voxels) != (scans, scans)) {
        assert!(begun.elapsed() < WITHIN, "node {node}: {:?}", site.state(node, map));
        sleep(Duration::from_millis(50));
    }
}

/// Takes the maps of a folder into a new NATS; what was printed, and what went wrong.
fn adopt_folder(site: &Site, folder: &Path) -> Result<String, String> {
    let mut command = Command::new(program());
    command.args(["cluster", "adopt", folder.to_str().unwrap(), "--of-node"]);
    let output = command.args(["--nats", &site.nats.urls().join(",")]).output().unwrap();
    match output.status.success() {
        true => Ok(String::from_utf8(output.stdout).unwrap()),
        false => Err(String::from_utf8(output.stderr).unwrap()),
    }
}

/// Takes the maps of a node's folder into a new NATS; what was printed.
fn adopt(site: &Site, node: usize) -> String {
    adopt_folder(site, &site.data(node)).unwrap()
}

/// All servers of NATS lose their disks.
fn lose_nats(site: &mut Site) {
    site.nats.kill_all();
    (0..NODES).for_each(|server| fs::remove_dir_all(site.nats.store(server)).unwrap());
    site.nats.start_all();
    drop(site.nats.engine());
}

#[test]
fn where_all_of_nats_is_lost_the_furthest_copy_of_each_map_is_taken_into_a_new_one() {
    let Some(mut site) = Site::start() else { return };
    let maps = ["hall", "yard"].map(|name| MapName::new(name).unwrap());
    for map in &maps {
        site.create(map);
        (0..4).for_each(|number| insert(&site, &site.all_grpc(0), map, number));
    }
    // All have it before anything is cut off.
    for map in &maps {
        (0..NODES).for_each(|node| wait_for(&site, node, map, 4));
    }
    // One that does not lead is cut off, and behind from then on.
    let led = maps.each_ref().map(|map| site.leader(map));
    let behind = (0..NODES).find(|node| !led.contains(node)).unwrap();
    site.cut_off(behind);
    let further = (behind + 1) % NODES;
    for map in &maps {
        (4..7).for_each(|number| insert(&site, &site.grpc(further), map, number));
    }
    (0..NODES).for_each(|node| site.kill_node(node));
    site.mend(behind);
    lose_nats(&mut site);

    // In any order.
    let last = (behind + 2) % NODES;
    for (node, words) in [
        (behind, "now, at revision 4:"),
        (further, "now, at revision 7 in the place of 4"),
        (last, "already"),
    ] {
        let said = adopt(&site, node);
        assert_eq!(said.matches(&format!("is in the cluster {words}")).count(), maps.len(), "{said}");
    }
    (0..NODES).for_each(|node| site.start_node(node));
    (0..NODES).for_each(|node| site.wait_until_ready(node));
    for map in &maps {
        insert(&site, &site.all_grpc(behind), map, 7);
        (0..NODES).for_each(|node| wait_for(&site, node, map, 8));
        let states: Vec<_> = (0..NODES).map(|node| site.state(node, map)).collect();
        assert!(states.iter().all(|state| *state == states[0]), "{states:?}");
    }
}

#[test]
fn a_further_copy_is_not_taken_under_a_node_that_was_started_and_a_folder_of_no_node_is_none() {
    let Some(mut site) = Site::start() else { return };
    let map = MapName::new("hall").unwrap();
    site.create(&map);
    (0..3).for_each(|number| insert(&site, &site.all_grpc(0), &map, number));
    (0..NODES).for_each(|node| wait_for(&site, node, &map, 3));
    let behind = (site.leader(&map) + 1) % NODES;
    site.cut_off(behind);
    let further = (0..NODES).find(|node| *node != behind).unwrap();
    insert(&site, &site.grpc(further), &map, 3);
    (0..NODES).for_each(|node| site.kill_node(node));
    site.mend(behind);
    lose_nats(&mut site);

    assert!(adopt(&site, behind).contains("now, at revision 3:"));
    site.start_node(behind);
    site.wait_until_ready(behind);
    let refused = adopt_folder(&site, &site.data(further)).unwrap_err();
    assert!(refused.contains("was started with an older copy: end all nodes"), "{refused}");

    let alone = site.data(0).with_file_name("alone");
    fs::create_dir_all(alone.join("maps")).unwrap();
    let refused = adopt_folder(&site, &alone).unwrap_err();
    assert!(refused.contains("belongs to no node of a cluster: adopt it without --of-node"), "{refused}");
}
