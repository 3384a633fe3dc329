//! Large grids in tiles: the same cells as a grid in one answer, over both protocols, and beyond its limits.

use mrol::client::Client;
use mrol::geometry::Pose;
use mrol::map::RobotName;
use mrol::mapping::Guess;
use mrol::planning::{BandFrom, Grid, GridArea};
use mrol::service::{GridQuestion, GridScope, PointCloud, QuestionScope, ScanRequest};
use mrol::wire::pb;
use prost::Message;
use serde_json::json;

use super::map;
use crate::support::daemon::{Daemon, json_of};

fn question(area: GridArea, cell_m: Option<f64>, tells_unknown: bool) -> GridQuestion {
    let scope = GridScope { area, band_m: [-0.5, 0.5], band_from: BandFrom::Map, cell_m, tells_unknown };
    GridQuestion { asked: QuestionScope::default(), scope }
}

fn rectangle(min_m: [f64; 2], max_m: [f64; 2]) -> GridArea {
    GridArea::Rectangle { min_m, max_m }
}

/// Walls of a room of 60 m by 50 m around the origin, seen from its middle.
async fn put_room(client: &Client) {
    let scan = |points: Vec<mrol::geometry::Point>| ScanRequest {
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("r").unwrap(), PointCloud::from(points))
    };
    let wall = (0..7200).flat_map(|i| {
        let angle = f64::from(i) * std::f64::consts::TAU / 7200.0;
        let reach = (30.0 / angle.cos().abs()).min(25.0 / angle.sin().abs());
        (-4..5).map(move |z| {
            [reach * angle.cos(), reach * angle.sin(), f64::from(z) * 0.1].map(|c| c as f32).into()
        })
    });
    let answer = client.insert_scan(&map(), scan(wall.collect())).await.unwrap();
    assert!(answer.accepted, "{answer:?}");
}

async fn room() -> (Daemon, Client) {
    let daemon = Daemon::start_with(|config| config.limits.question_time_max_s = 60.0).await;
    daemon.make_map("a").await;
    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    put_room(&client).await;
    (daemon, client)
}

/// Cells, NaN being equal to itself.
fn same(one: &Grid, other: &Grid) -> bool {
    let bits = |grid: &Grid| grid.tops_m.iter().map(|top| top.to_bits()).collect::<Vec<_>>();
    (one.cell_m, one.origin_m, one.size, &one.occupied, &one.free)
        == (other.cell_m, other.origin_m, other.size, &other.occupied, &other.free)
        && bits(one) == bits(other)
}

#[tokio::test]
async fn tiles_join_to_the_grid_of_one_answer() {
    let (_daemon, client) = room().await;
    let areas = [
        GridArea::Occupied,
        rectangle([-40.0, -3.3], [31.27, 60.0]),
        rectangle([25.6, 25.6], [25.6, 25.6]),
        rectangle([-0.04, -0.04], [25.64, 0.01]),
    ];
    for area in areas {
        for (cell_m, unknown) in [(None, true), (None, false), (Some(0.4), true), (Some(51.2), false)] {
            let question = question(area, cell_m, unknown);
            let expected = client.project_grid(&map(), question).await.unwrap();
            let (joined, versions) = client.whole_grid(&map(), question).await.unwrap();
            assert!(same(&joined, &expected.answer), "{area:?}, {cell_m:?}, {unknown}");
            assert_eq!(versions, [expected.version; 2]);
        }
    }
    let whole = client.whole_grid(&map(), question(GridArea::Occupied, None, true)).await.unwrap().0;
    assert!(whole.free.unwrap().iter().any(|word| *word != 0) && whole.size[0] > 512, "several tiles");
}

#[tokio::test]
async fn a_site_that_is_too_large_for_one_answer_comes_in_tiles_over_both_protocols() {
    let (daemon, client) = room().await;
    let site = question(rectangle([-128.0, -128.0], [128.0, 128.0]), None, true);
    let refused = client.project_grid(&map(), site).await.unwrap_err().to_string();
    assert!(refused.contains("grid_cells_max") && refused.contains("tiles"), "{refused}");
    let (joined, _) = client.whole_grid(&map(), site).await.unwrap();
    assert_eq!(joined.size, [2560, 2560]);
    let near = client.project_grid(&map(), question(GridArea::Occupied, None, true)).await.unwrap().answer;
    let ones = |words: &[u64]| words.iter().map(|word| word.count_ones()).sum::<u32>();
    assert_eq!(ones(&joined.occupied), ones(&near.occupied));
    assert!(ones(&near.occupied) > 1000);

    let body = json!({"area": {"min_m": [-128, -128], "max_m": [128, 128]}, "min_z_m": -0.5, "max_z_m": 0.5,
                      "band_from": "map", "tell_unknown": true});
    let answer = daemon.post("/v1/maps/a/grid/tiles", body).await;
    assert_eq!(answer.headers()["content-type"], "application/octet-stream");
    let tiles = tiles_of(&answer.bytes().await.unwrap());
    assert_eq!(tiles.len() as u64, tiles[0].tiles);
    let mut over_http = Grid::empty(joined.cell_m, joined.origin_m, joined.size, true);
    for tile in tiles {
        let part: mrol::service::GridTile = tile.try_into().unwrap();
        assert!(over_http.put(part.first, &part.grid.answer));
    }
    assert!(same(&over_http, &joined));
}

/// The messages of a stream over HTTP.
fn tiles_of(mut bytes: &[u8]) -> Vec<pb::GridTile> {
    let mut tiles = Vec::new();
    while let Some((length, rest)) = bytes.split_first_chunk::<4>() {
        let (tile, rest) = rest.split_at(u32::from_le_bytes(*length) as usize);
        tiles.push(pb::GridTile::decode(tile).unwrap());
        bytes = rest;
    }
    tiles
}

#[tokio::test]
async fn each_tile_names_its_revision_and_changes_go_on_between_them() {
    let (_daemon, client) = room().await;
    let begin = client.map_info(&map()).await.unwrap().version.revision;
    let mut tiles =
        client.grid_tiles(&map(), question(rectangle([0.0; 2], [400.0; 2]), None, false)).await.unwrap();
    let first = tiles.next().await.unwrap().unwrap();
    assert_eq!((first.grid.version.revision, first.first), (begin, [0, 0]));
    // Tiles are drawn when those before them were taken: all but a few are of the new revision.
    let deletion = mrol::service::Deletion {
        target: mrol::service::DeletionTarget::Points(
            vec![mrol::geometry::Point::new(30.0, 0.05, 0.0)].into(),
        ),
        level: 2,
        request_id: None,
    };
    assert!(client.delete_voxels(&map(), deletion).await.unwrap().removed > 0);
    let mut last = first;
    while let Some(tile) = tiles.next().await {
        last = tile.unwrap();
    }
    assert_eq!(last.grid.version.revision, begin + 1);
}

#[tokio::test]
async fn tiles_end_with_what_is_wrong() {
    let daemon = Daemon::start_with(|config| config.limits.grid_time_max_s = 1e-9).await;
    daemon.make_map("a").await;
    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    put_room(&client).await;
    let refused = client.whole_grid(&map(), question(GridArea::Occupied, None, false)).await.unwrap_err();
    assert!(refused.to_string().contains("grid_time_max_s"), "{refused}");
    let answer = daemon.post("/v1/maps/a/grid/tiles", json!({})).await;
    let tiles = tiles_of(&answer.bytes().await.unwrap());
    let failure = tiles.last().unwrap().failure.clone().unwrap();
    assert_eq!((tiles.len(), failure.reason.as_str()), (1, "time_limit"));
    // What is known before the first tile is an ordinary refusal.
    let huge = json!({"area": {"min_m": [-9000, -9000], "max_m": [9000, 9000]}});
    let refused = json_of(daemon.post("/v1/maps/a/grid/tiles", huge).await).await;
    assert_eq!(refused["reason"], "grid_too_large", "{refused}");
}

#[tokio::test]
async fn a_map_without_a_voxel_has_one_tile_without_cells() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    let (grid, versions) =
        client.whole_grid(&map(), question(GridArea::Occupied, None, false)).await.unwrap();
    assert_eq!((grid.cells(), grid.size, versions[0].revision), (0, [0, 0], 0));
}
