//! Maps of a server by itself are taken into a cluster, and the cluster is looked at and changed by whoever is no node.

use std::path::Path;

use mrol_cluster::{CatalogError, ClusterStore, EnterError, Holders, NoStore, OverviewReader, StreamError};
use mrol_map::map::MapSettings;
use mrol_service::replication::NodeName;
use mrol_service::{MapService, NewMap, ServiceSettings};
use mrol_store::OpeningProgress;
use tempfile::TempDir;
use tokio::runtime::Runtime;

use crate::nodes::{Server, leader, name, retried, waited};
use crate::support::{NatsServers, eventually};

/// A map of a server by itself, with some scans, as it is to be shared.
fn alone(folder: &Path, map: &str, scans: u64) -> NewMap {
    let runtime = Runtime::new().unwrap();
    let settings = ServiceSettings { data_dir: Some(folder.to_owned()), ..ServiceSettings::default() };
    let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
    runtime.block_on(async {
        service.create_map(name(map), MapSettings::new(0.5, 2)).await.unwrap();
        for number in 0..scans {
            service.insert_scan(&name(map), Server::scan(number)).await.unwrap();
        }
        service.to_share(&name(map)).await.unwrap()
    })
}

#[test]
fn a_map_that_is_adopted_keeps_its_uuid_and_its_revisions() {
    let Some(nats) = NatsServers::start(3) else { return };
    drop(nats.engine());
    let missing = ClusterStore::find(&nats.settings()).unwrap_err();
    assert!(matches!(missing, NoStore::Stream(StreamError::Missing(_))), "{missing}");
    let store = eventually(|| ClusterStore::create(&nats.settings()));
    let folders: Vec<_> = (0..2).map(|_| TempDir::new().unwrap()).collect();
    let new = alone(folders[0].path(), "hall", 4);
    // An attempt that was cut short leaves what it has put.
    store.bases.put(new.uuid, &new.base, &new.file).unwrap();
    store.pointers.change(new.uuid, &new.base, 0).unwrap();
    assert_eq!(store.enter(&name("hall"), &new, &Holders::All), Ok(new.uuid));
    assert_eq!(store.enter(&name("hall"), &new, &Holders::All), Ok(new.uuid), "it is there");
    let taken = store.enter(&name("yard"), &new, &Holders::All).unwrap_err();
    assert_eq!(taken, EnterError::Catalog(CatalogError::OtherName(name("hall"))));
    let other = NewMap { uuid: uuid::Uuid::new_v4(), ..new.clone() };
    assert_eq!(store.enter(&name("hall"), &other, &Holders::All), Ok(new.uuid), "another has the name");
    assert_eq!(store.pointers.read(other.uuid).unwrap(), None, "and nothing was put");

    // A node of an empty folder begins with the base, and that of the folder itself with what it has.
    let (a, b) = (Server::start(&nats, "a", folders[0].path()), Server::start(&nats, "b", folders[1].path()));
    let led = leader(&[&a, &b], "hall");
    assert_eq!(retried(|| led.insert("hall", 4)), 5);
    waited("equal copies", || a.version("hall") == b.version("hall") && a.version("hall").is_some());
    let uuid = a.runtime.block_on(a.service.version_of(&name("hall"))).unwrap().map_uuid;
    assert_eq!(uuid, new.uuid);

    // Once it was deleted, it does not come back.
    a.runtime.block_on(a.service.delete_map(&name("hall"))).unwrap();
    let deleted = store.enter(&name("hall"), &new, &Holders::All).unwrap_err();
    assert_eq!(deleted, EnterError::Catalog(CatalogError::Deleted(new.uuid)));
}

#[test]
fn what_was_removed_after_it_was_put_can_be_entered_again() {
    let Some(nats) = NatsServers::start(1) else { return };
    let store = eventually(|| ClusterStore::create(&nats.settings()));
    let folder = TempDir::new().unwrap();
    let new = alone(folder.path(), "hall", 1);
    store.bases.put(new.uuid, &new.base, &new.file).unwrap();
    let revision = store.pointers.change(new.uuid, &new.base, 0).unwrap();
    store.pointers.forget(new.uuid, revision).unwrap();
    assert_eq!(store.enter(&name("hall"), &new, &Holders::All), Ok(new.uuid));
    assert_eq!(store.pointers.read(new.uuid).unwrap().map(|(base, _)| base), Some(new.base));
    let streams = store.stream_copies([new.uuid]);
    assert_eq!(streams.len(), 5);
    for stream in streams {
        let servers = stream.servers.unwrap();
        assert_eq!((servers.replicas, servers.behind), (1, Vec::new()), "{}", stream.stream);
    }
}

#[test]
fn the_lead_goes_where_it_is_wished_and_the_beats_say_so() {
    let Some(nats) = NatsServers::start(3) else { return };
    drop(nats.engine());
    let folders: Vec<_> = (0..2).map(|_| TempDir::new().unwrap()).collect();
    let (a, b) = (Server::start(&nats, "a", folders[0].path()), Server::start(&nats, "b", folders[1].path()));
    assert!(a.create("hall"));
    let reader = OverviewReader::begin(ClusterStore::find(&nats.settings()).unwrap()).unwrap();
    let led_by = |node: &str| {
        let seen = reader.look().unwrap();
        let led = seen.map(&name("hall")).and_then(|map| map.leader()).map(|copy| copy.node.to_string());
        led.as_deref() == Some(node)
    };
    for wished in ["b", "a", "b"] {
        let node = NodeName::new(wished).unwrap();
        assert!(reader.store().catalog.set_leader(&name("hall"), Some(&node)).unwrap());
        waited("the beats say so", || led_by(wished));
        let there = if wished == "a" { &a } else { &b };
        assert!(there.leads("hall"));
    }
    assert!(reader.settled().unwrap().nodes.iter().all(|node| node.is_live));
    // Of one that is gone the beats do not say any more that it leads.
    b.vanish();
    let reader = OverviewReader::begin(reader.store().clone()).unwrap();
    let seen = reader.settled().unwrap();
    let live: Vec<_> = seen.nodes.iter().map(|seen| (seen.node.as_str(), seen.is_live)).collect();
    assert_eq!(live, [("a", true), ("b", false)]);
}
