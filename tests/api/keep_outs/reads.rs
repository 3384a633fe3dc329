//! Queries and listings that regard keep-outs.

use super::{ball, client_of, map, put, started};

use mrol::map::{KeepOutShape, Region};
use mrol::service::ListingRequest;
use mrol::wire::pb;
use serde_json::json;

use crate::support::daemon::{Daemon, bits_of, bytes_of, json_of, points_pb, row};

#[tokio::test]
async fn queries_and_listings_regard_keep_outs_where_they_are_asked_to() {
    let daemon = started().await;
    let client = client_of(&daemon).await;
    client.put_keep_out(&map("a"), put("far", ball([5.0, 0.05, 0.05], 0.16))).await.unwrap();
    client.put_keep_out(&map("a"), put("over", ball([0.05, 0.05, 0.05], 0.11))).await.unwrap();
    let points = [[0.05, 0.05, 0.05], [5.0, 0.05, 0.15], [5.0, 0.05, 0.25], [0.05, 0.15, 0.05], [3.0; 3]];
    let bits = [("", [true, false, false, false, false]), ("true", [true, true, false, true, false])];
    for (keep_out, expected) in bits {
        let asks = !keep_out.is_empty();
        let message = pb::QueryPointsRequest {
            map: "a".into(),
            points: points_pb(&points),
            keep_out: asks,
            ..Default::default()
        };
        let answer = daemon.occupancy().await.query_points(message).await.unwrap().into_inner();
        assert_eq!(bits_of(&answer.occupied, 5), expected);
        assert_eq!(answer.points_occupied, expected.iter().filter(|bit| **bit).count() as u64);
        let body = json!({"points": points, "keep_out": asks});
        let answer = json_of(daemon.post("/v1/maps/a/occupancy", body).await).await;
        assert_eq!((&answer["occupied"], &answer["revision"]), (&json!(expected), &json!(3)));
        let route = format!("/v1/maps/a/occupancy?keep_out={asks}&lookup=bloom");
        let answer = daemon.post_bytes(&route, bytes_of(&points)).await.bytes().await.unwrap();
        assert_eq!(bits_of(&answer, 5), expected);
    }
    // The row, and the centers within 0.11 m of its first voxel and within 0.16 m of the middle of two others.
    let listed = json_of(daemon.get("/v1/maps/a/voxels?keep_out=true").await).await;
    let mut voxels: Vec<[i32; 3]> = serde_json::from_value(listed["voxels"].clone()).unwrap();
    voxels.sort_unstable();
    let is_near = |[x, y, z]: [i32; 3]| {
        let away = [x, y, z].map(|i| (f64::from(i) + 0.5) * 0.1);
        let from = |center: [f64; 3]| (0..3).map(|i| (away[i] - center[i]).powi(2)).sum::<f64>().sqrt();
        (y == 0 && z == 0 && (0..10).contains(&x))
            || from([0.05; 3]) <= 0.11
            || from([5.0, 0.05, 0.05]) <= 0.16
    };
    let around = (-5..60).flat_map(|x| (-5..5).flat_map(move |y| (-5..5).map(move |z| [x, y, z])));
    assert_eq!(voxels, around.filter(|&index| is_near(index)).collect::<Vec<_>>());
    let region = Some(Region::cuboid([0.0, 0.0, 0.0], [0.5, 1.0, 1.0]).unwrap());
    let query = ListingRequest { keep_out: true, ..ListingRequest::of(0, region) };
    let part = client.list_voxels(&map("a"), query).await.unwrap().keys;
    assert_eq!(part.len(), 5 + 2, "{part:?}");
    // Counted, each of them once.
    for (query, count) in
        [(query, part.len()), (ListingRequest { keep_out: true, ..Default::default() }, voxels.len())]
    {
        let counted =
            client.list_voxels(&map("a"), ListingRequest { count_only: true, ..query }).await.unwrap();
        assert_eq!((counted.voxels_total, counted.keys.len()), (count, 0));
    }
}

#[tokio::test]
async fn a_listing_of_more_than_may_be_listed_is_refused_and_one_of_a_part_is_not() {
    let daemon = Daemon::start_with(|config| config.limits.listed_voxels_max = 1000).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(10)).await;
    let client = client_of(&daemon).await;
    let cube = |side: f64| KeepOutShape::of_region(Region::cuboid([0.0; 3], [side; 3]).unwrap()).unwrap();
    let query = ListingRequest { keep_out: true, ..ListingRequest::default() };
    client.put_keep_out(&map("a"), put("cube", cube(1.0))).await.unwrap();
    assert_eq!(client.list_voxels(&map("a"), query).await.unwrap().keys.len(), 1000);
    client.put_keep_out(&map("a"), put("cube", cube(1e12))).await.unwrap();
    let refused = json_of(daemon.get("/v1/maps/a/voxels?keep_out=true").await).await;
    assert_eq!(refused["reason"], "listing_too_large", "{refused}");
    assert!(refused["detail"].as_str().unwrap().contains("listed_voxels_max, which is 1000"), "{refused}");
    let region = Some(Region::cuboid([0.0; 3], [0.42; 3]).unwrap());
    let part = client
        .list_voxels(&map("a"), ListingRequest { keep_out: true, ..ListingRequest::of(0, region) })
        .await
        .unwrap();
    assert_eq!(part.keys.len(), 64);
    assert_eq!(client.list_voxels(&map("a"), ListingRequest::default()).await.unwrap().keys.len(), 10);
}
