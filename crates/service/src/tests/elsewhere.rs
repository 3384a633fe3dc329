//! A node that is asked for a map which other nodes hold, and one that leaves a map to others.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use uuid::Uuid;

use super::two_nodes::{Other, TwoNodes, scan_of};
use crate::caller::{AllowedMaps, AllowedScans};
use crate::cluster::{Cluster, Later, NewMap, SharedCatalog};
use crate::error::{MapHolder, Reason, ServiceError};
use crate::map_service::MapService;
use crate::replication::NodeName;
use crate::request::{MapElsewhere, PointQuery, WatchForm, WatchRequest};
use crate::settings::ServiceSettings;
use mrol_map::geometry::Point;
use mrol_map::map::{Lookup, MapName, MapSettings};
use mrol_store::OpeningProgress;

/// A list of maps of which others hold all.
#[derive(Debug)]
struct HeldByOthers;

fn holder() -> MapHolder {
    let [node, http, grpc] = ["b", "http://b:7333", "http://b:7334"].map(str::to_owned);
    MapHolder { node, http, grpc }
}

fn elsewhere<'a, A: Send + 'a>(name: &MapName) -> Later<'a, Result<A, ServiceError>> {
    Box::pin(std::future::ready(Err(ServiceError::map_elsewhere(name, vec![holder()]))))
}

impl SharedCatalog for HeldByOthers {
    fn enter<'a>(&'a self, name: &'a MapName, _: NewMap) -> Later<'a, Result<bool, ServiceError>> {
        elsewhere(name)
    }

    fn look_for<'a>(&'a self, name: &'a MapName) -> Later<'a, Result<bool, ServiceError>> {
        elsewhere(name)
    }

    fn held_elsewhere(&self) -> Vec<MapElsewhere> {
        let map = |name: &str| MapElsewhere { name: MapName::new(name).unwrap(), holders: vec![holder()] };
        vec![map("hall"), map("yard")]
    }

    fn delete<'a>(&'a self, name: &'a MapName, _: Uuid) -> Later<'a, Result<(), ServiceError>> {
        unreachable!("map {name} is not deleted by a node that has no copy")
    }
}

#[tokio::test]
async fn whoever_asks_a_node_for_a_map_that_others_hold_hears_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let settings = ServiceSettings {
        data_dir: Some(folder.path().to_owned()),
        cluster: Some(Cluster {
            node: NodeName::new("a").unwrap(),
            forward: Arc::<Other>::default(),
            catalog: Arc::new(HeldByOthers),
        }),
        ..ServiceSettings::default()
    };
    let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
    let hall = MapName::new("hall").unwrap();
    let watch = WatchRequest { since: None, region: None, form: WatchForm::Changes, viewpoints: false };
    let alone = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
    alone.create_map(hall.clone(), MapSettings::new(0.1, 3)).await.unwrap();
    let file: Bytes = alone.snapshot_map(&hall).await.unwrap().bytes;
    let refused = [
        service.map_info(&hall).await.map(drop),
        service.insert_scan(&hall, scan_of("r", 0.05)).await.map(drop),
        service.snapshot_map(&hall).await.map(drop),
        service.watch(&hall, watch).await.map(drop),
        service.delete_map(&hall).await,
        service.create_map(hall.clone(), MapSettings::new(0.1, 3)).await.map(drop),
        service.restore_map(hall.clone(), file, false).await.map(drop),
    ];
    for refused in refused {
        let error = refused.unwrap_err();
        assert_eq!((error.reason, &*error.holders), (Reason::MapElsewhere, &[holder()][..]), "{error}");
        assert!(error.message.contains("node b (http://b:7333, gRPC http://b:7334)"), "{error}");
    }
    let listed = |service: &MapService| -> Vec<String> {
        service.maps_elsewhere().into_iter().map(|map| map.name.to_string()).collect()
    };
    assert_eq!(listed(&service), ["hall", "yard"]);
    // Whoever may not name the map is told nothing of it.
    let yard = AllowedMaps::Only(Arc::new([MapName::new("yard").unwrap()].into()));
    let limited = service.limited_to(None, yard, AllowedScans::default());
    let error = limited.map_info(&hall).await.unwrap_err();
    assert_eq!((error.reason, error.holders.len()), (Reason::MapNotAllowed, 0));
    assert_eq!(listed(&limited), ["yard"]);
}

#[tokio::test]
async fn whoever_waits_for_a_map_hears_that_the_node_leaves_it_to_others() {
    let nodes = TwoNodes::led_by_a().await;
    let service = &nodes.b.service;
    let waiting = service.version_of(&nodes.map).await.unwrap();
    let query = PointQuery {
        points: vec![Point::new(0.0, 0.0, 0.0)].into(),
        map_from_points: None,
        level: 0,
        lookup: Lookup::Exact,
        min_revision: Some(waiting.revision + 1),
        map_uuid: None,
        keep_out: false,
    };
    let asked = service.query_points(&nodes.map, query);
    let leaves = async {
        tokio::time::sleep(Duration::from_millis(50)).await;
        service.leave_to_others(&nodes.map, Uuid::nil()).await.unwrap();
        assert!(service.version_of(&nodes.map).await.is_ok(), "that is another map");
        service.leave_to_others(&nodes.map, waiting.map_uuid).await.unwrap();
    };
    let (answer, ()) = tokio::join!(asked, leaves);
    let error = answer.unwrap_err();
    assert_eq!((error.reason, error.holders.len()), (Reason::MapElsewhere, 0), "{error}");
    assert_eq!(service.version_of(&nodes.map).await.unwrap_err().reason, Reason::MapNotFound);
    assert!(nodes.a.service.insert_scan(&nodes.map, scan_of("r", 0.05)).await.unwrap().accepted);
}
