//! Data folders of former releases are adopted by a cluster, and come back to a server by itself.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use mrol::geometry::Point;
use mrol::map::MapName;
use mrol::service::{MapService, ServiceSettings};
use mrol::store::OpeningProgress;
use serde_json::Value;
use tempfile::TempDir;

use crate::nats::copy_folder;
use crate::site::{MapState, NODES, Site, WITHIN, program};

/// The node whose folder is one of a former release.
const OWNER: usize = 2;

fn office() -> MapName {
    MapName::new("office").unwrap()
}

/// The folders, by their versions.
fn released() -> Vec<PathBuf> {
    let entries = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/released")).unwrap();
    let mut folders: Vec<_> =
        entries.map(|entry| entry.unwrap().path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

/// How a server by itself has the map of a copy of a folder.
fn state_alone(site: &Site, folder: &Path) -> MapState {
    let copy = TempDir::new().unwrap();
    copy_folder(folder, copy.path());
    let settings = ServiceSettings { data_dir: Some(copy.path().to_owned()), ..ServiceSettings::default() };
    let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
    MapState::of(&site.runtime().block_on(service.map_info(&office())).unwrap())
}

/// Adopts the maps of the owner's folder: the uuid of the only one.
fn adopt(site: &Site) -> String {
    let mut command = Command::new(program());
    command.args(["cluster", "adopt", site.data(OWNER).to_str().unwrap(), "--json"]);
    let output = command.args(["--nats", &site.nats.urls().join(",")]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let adopted: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(adopted["map"], "office");
    adopted["map_uuid"].as_str().unwrap().to_owned()
}

/// Puts one voxel more into the map, far from all others; the revision that it makes.
fn insert(site: &Site, addresses: &str, number: u64) -> u64 {
    site.insert(addresses, &office(), number, Point::new(300.0 + number as f32, 0.0, 0.0))
}

/// Waits until a map is at a node as is expected.
#[track_caller]
fn wait_for(site: &Site, node: usize, what: &str, is_so: impl Fn(Option<MapState>) -> bool) {
    let begun = Instant::now();
    while !is_so(site.state(node, &office())) {
        let state = site.state(node, &office());
        assert!(begun.elapsed() < WITHIN, "{what}: {state:?} at {node}, {}", site.log_of(node));
        sleep(Duration::from_millis(20));
    }
}

#[test]
fn released_data_folders_are_adopted_by_a_cluster_and_leave_it_again() {
    let Some(mut site) = Site::start() else { return };
    let folders = released();
    assert!(folders.len() >= 7, "{folders:?}");
    for folder in folders {
        println!("{}", folder.file_name().unwrap().to_string_lossy());
        site.kill_node(OWNER);
        fs::remove_dir_all(site.data(OWNER)).unwrap();
        copy_folder(&folder, &site.data(OWNER));
        let expected = state_alone(&site, &folder);
        let uuid = adopt(&site);
        let kept = fs::read_dir(folder.join("maps")).unwrap().next().unwrap().unwrap().file_name();
        if let Some((_, before)) = kept.to_str().unwrap().split_once('.').filter(|(_, it)| *it != "mrol") {
            assert_eq!(uuid, before, "its uuid is kept");
        }

        // All nodes have it: that of the folder, and those that load it.
        site.start_node(OWNER);
        let adopted = MapState { uuid: uuid.parse().unwrap(), ..expected };
        (0..NODES).for_each(|node| wait_for(&site, node, "it is there", |there| there == Some(adopted)));
        let revision = insert(&site, &site.all_grpc(0), 1);
        let (scans, voxels) = (expected.scans + 1, expected.voxels + 1);
        let is_changed = |there: Option<MapState>| {
            there.is_some_and(|it| {
                (it.revision, it.scans, it.voxels, it.uuid) == (revision, scans, voxels, adopted.uuid)
            })
        };
        (0..NODES).for_each(|node| wait_for(&site, node, "it has changed", is_changed));
        let changed = site.state(OWNER, &office()).unwrap();
        assert_eq!((revision, Some(changed)), (expected.revision + 1, site.state(0, &office())));

        // The folder leaves; a server by itself does not open it before.
        site.end_node(OWNER);
        site.start_alone(OWNER, &[]);
        assert!(!site.has_succeeded(OWNER), "it is a node's");
        site.start_alone(OWNER, &["--leave-cluster"]);
        site.wait_until_ready(OWNER);
        let left = site.state(OWNER, &office()).unwrap();
        assert_ne!(left.uuid, changed.uuid);
        assert_eq!(left, MapState { uuid: left.uuid, ..changed }, "all that it had");
        site.end_node(OWNER);
        site.start_alone(OWNER, &[]);
        site.wait_until_ready(OWNER);
        assert_eq!(site.state(OWNER, &office()), Some(left));
        assert_eq!(insert(&site, &site.grpc(OWNER), 2), revision + 1, "it goes on by itself");
        let here = site.state(0, &office()).unwrap();
        assert_eq!((here.revision, here.voxels), (revision, voxels), "and so does the cluster");

        site.delete(0, &office());
        wait_for(&site, 1, "it is deleted", |there| there.is_none());
    }
}
