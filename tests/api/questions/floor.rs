//! Grids whose band counts from the floor: alike over both protocols, in tiles, and by a replica.

use mrol::client::{Client, Replica, ReplicaOptions};
use mrol::geometry::{Point, Pose};
use mrol::map::{Region, RobotName};
use mrol::mapping::Guess;
use mrol::planning::{BandFrom, Grid, GridArea};
use mrol::service::{GridQuestion, GridScope, PointCloud, QuestionScope, ScanRequest};
use serde_json::json;

use super::{map, row_of_voxels};
use crate::support::daemon::{Daemon, json_of};

/// Where the floor is: in voxels that reach up to 1.7 m below the sensor.
const FLOOR_M: f64 = -1.75;

/// What a lidar sees in the middle of a room of 8 m by 8 m, a ray a degree.
fn room() -> Vec<Point> {
    let rays = (0..360).flat_map(|azimuth| (-60..30).map(move |elevation| [azimuth, elevation]));
    let end = |[azimuth, elevation]: [i32; 2]| {
        let [azimuth, elevation] =
            [azimuth, elevation].map(|degrees| (f64::from(degrees) + 0.3).to_radians());
        let along = [azimuth.cos(), azimuth.sin()].map(|c| c * elevation.cos());
        let wall_m = 4.05 / along[0].abs().max(along[1].abs());
        let floor_m = if elevation < 0.0 { FLOOR_M / elevation.sin() } else { f64::INFINITY };
        let range_m = wall_m.min(floor_m);
        Point::from([along[0], along[1], elevation.sin()].map(|c| (c * range_m) as f32))
    };
    rays.map(end).collect()
}

async fn server() -> (Daemon, Client) {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    let scan = ScanRequest {
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("r").unwrap(), PointCloud::from(room()))
    };
    assert!(client.insert_scan(&map(), scan).await.unwrap().accepted);
    (daemon, client)
}

fn question(band_m: [f64; 2], band_from: BandFrom) -> GridQuestion {
    let area = GridArea::Rectangle { min_m: [-3.0; 2], max_m: [4.5; 2] };
    let scope = GridScope { area, band_m, band_from, cell_m: None, tells_unknown: true };
    GridQuestion { asked: QuestionScope::default(), scope }
}

fn cells(grid: &Grid) -> (&[u64], Option<&[u64]>) {
    (&grid.occupied, grid.free.as_deref())
}

#[tokio::test]
async fn a_band_counts_from_the_floor_alike_everywhere() {
    let (daemon, client) = server().await;
    let from_floor = question([0.1, 1.8], BandFrom::Floor);
    let told = client.project_grid(&map(), from_floor).await.unwrap().answer;
    let from_map = client.project_grid(&map(), question([-1.6, 0.1], BandFrom::Map)).await.unwrap().answer;
    assert_eq!((cells(&told), from_map.floor_m), (cells(&from_map), None));
    let [low_m, high_m] = told.floor_m.unwrap();
    // A wall begins one voxel above the floor beside it.
    assert!((low_m + 1.7).abs() < 1e-9 && (high_m + 1.65).abs() < 0.051, "{low_m}..{high_m}");
    let (whole, _) = client.whole_grid(&map(), from_floor).await.unwrap();
    assert_eq!((cells(&whole), whole.floor_m), (cells(&told), told.floor_m));

    let replica = Replica::open(client.clone(), map(), ReplicaOptions::default()).await.unwrap();
    let own = replica.ask(&from_floor).unwrap().answer;
    assert_eq!((cells(&own), own.floor_m), (cells(&told), told.floor_m));

    let area = json!({"min_m": [-3, -3], "max_m": [4.5, 4.5]});
    let asked = json!({"area": area, "min_z_m": 0.1, "max_z_m": 1.8});
    let floor = json_of(daemon.post("/v1/maps/a/grid", asked).await).await;
    let asked = json!({"area": area, "min_z_m": -1.6, "max_z_m": 0.1, "band_from": "map"});
    let of_map = json_of(daemon.post("/v1/maps/a/grid", asked).await).await;
    assert_eq!(floor["occupied"], of_map["occupied"]);
    assert!(
        (floor["floor_m"][0].as_f64().unwrap() + 1.7).abs() < 1e-9 && of_map["floor_m"].is_null(),
        "{floor}"
    );
}

#[tokio::test]
async fn where_no_floor_can_be_known_it_is_told_what_to_give() {
    let (_daemon, client) = server().await;
    let region = Some(Region::cuboid([-3.5, -3.5, -3.0], [4.4, 4.4, 3.0]).unwrap());
    let of_part = ReplicaOptions { region, ..ReplicaOptions::default() };
    let blind = ReplicaOptions { viewpoint_bytes_max: 0, ..ReplicaOptions::default() };
    for (options, said) in [(of_part, "where a replica copies a region"), (blind, "with band_from map")] {
        let replica = Replica::open(client.clone(), map(), options).await.unwrap();
        let error = replica.ask(&question([0.1, 1.8], BandFrom::Floor)).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    let (daemon, client, _) = row_of_voxels().await;
    for error in [
        client.project_grid(&map(), question([0.1, 1.8], BandFrom::Floor)).await.unwrap_err().to_string(),
        client.whole_grid(&map(), question([0.1, 1.8], BandFrom::Floor)).await.unwrap_err().to_string(),
    ] {
        assert!(
            error.contains("no floor was found below any of") && error.contains("band_from map"),
            "{error}"
        );
    }
    let told = daemon.post("/v1/maps/a/grid", json!({"min_z_m": 0.1})).await;
    assert_eq!(told.status(), 412);
    assert_eq!(json_of(told).await["reason"], "no_floor");
    let told = daemon.post("/v1/maps/a/grid", json!({"min_z_m": 0.1, "band_from": "roof"})).await;
    assert_eq!(told.status(), 400);
    // Without bounds no floor is needed.
    let band_m = [f64::NEG_INFINITY, f64::INFINITY];
    assert!(
        client
            .project_grid(&map(), question(band_m, BandFrom::Floor))
            .await
            .unwrap()
            .answer
            .floor_m
            .is_none()
    );
}
