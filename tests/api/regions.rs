//! Boxes of any orientation: listing and deleting what lies in one, over both protocols.

use mrol::wire::pb;
use serde_json::json;

use crate::support::daemon::{Daemon, json_of, row};

/// About 0.5 m, 0, 0, along the bisector of x and y: of a row of points along x it holds those around its center.
const PLACED: [f64; 7] = [0.5, 0.05, 0.05, 0.0, 0.0, 0.382_683_432_365_089_8, 0.923_879_532_511_286_7];

fn placed() -> String {
    PLACED.map(|number| number.to_string()).join(",")
}

fn oriented_box(size_m: [f64; 3]) -> pb::Region {
    let [x, y, z, qx, qy, qz, qw] = PLACED;
    let map_from_box = pb::Pose {
        translation_m: Some([x, y, z].into()),
        rotation: Some(pb::Quaternion { x: qx, y: qy, z: qz, w: qw }),
    };
    let of = pb::OrientedBox { map_from_box: Some(map_from_box), size_m: Some(size_m.into()) };
    pb::Region { shape: Some(pb::region::Shape::OrientedBox(of)) }
}

#[tokio::test]
async fn a_box_at_an_angle_lists_and_deletes_what_its_axes_enclose() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(20)).await;
    // Across the row the box is 0.1 m thick, at 45 degrees: 0.141 m of the row, one center beside the middle each way.
    let inside = [[4, 0, 0], [5, 0, 0]];
    let route = format!("/v1/maps/a/voxels?map_from_box={}&size=4,0.15,1", placed());
    let listed = json_of(daemon.get(&route).await).await;
    assert_eq!(listed["voxels"], json!(inside), "{listed}");

    let request = pb::ListVoxelsRequest {
        map: "a".into(),
        region: Some(oriented_box([4.0, 0.15, 1.0])),
        ..Default::default()
    };
    let mut stream = daemon.occupancy().await.list_voxels(request).await.unwrap().into_inner();
    let mut keys = Vec::new();
    while let Some(message) = stream.message().await.unwrap() {
        keys.extend(message.keys);
    }
    assert_eq!(keys, [4, 5]);

    let pose = json!({"translation_m": PLACED[..3], "rotation_xyzw": PLACED[3..]});
    let deletion = json!({"oriented_box": {"map_from_box": pose, "size_m": [4, 0.15, 1]}});
    let deleted = json_of(daemon.post("/v1/maps/a/deletions", deletion).await).await;
    assert_eq!(deleted["removed"], 2, "{deleted}");
    assert!(json_of(daemon.get(&route).await).await["voxels"].as_array().unwrap().is_empty());
}

#[tokio::test]
async fn a_box_of_bad_numbers_is_refused_by_name() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    for (params, words) in [
        (format!("map_from_box={}&size=1,-1,1", placed()), "size_m must not be negative"),
        (format!("map_from_box={}&size=1,1,inf", placed()), "within 1e12 m"),
        ("map_from_box=0,0,0,0,0,0,2&size=1,1,1".to_owned(), "map_from_box: rotation_xyzw"),
        (format!("map_from_box={}", placed()), "map_from_box and size"),
    ] {
        let answer = daemon.get(&format!("/v1/maps/a/voxels?{params}")).await;
        assert_eq!(answer.status(), 400, "{params}");
        let said = json_of(answer).await["detail"].as_str().unwrap().to_owned();
        assert!(said.contains(words), "{said}");
    }
    let request = pb::ListVoxelsRequest {
        map: "a".into(),
        region: Some(oriented_box([1.0, f64::NAN, 1.0])),
        ..Default::default()
    };
    let refused = daemon.occupancy().await.list_voxels(request).await.unwrap_err();
    assert!(refused.message().contains("size_m must not be negative"), "{refused}");
}
