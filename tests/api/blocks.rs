//! Blocks of a map, dense and sparse; voxels that a camera sees, and that are only counted.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use mrol::client::{Client, Replica, ReplicaOptions};
use mrol::map::{DistanceBlock, Frustum, MapName, Region, VoxelSelection};
use mrol::service::{BlockAnswer, BlockForm, BlockRequest, BlockVoxels, ListingRequest};
use mrol::wire::pb;
use reqwest::{Response, StatusCode};
use serde_json::{Value, json};

use crate::support::daemon::{Daemon, PATIENCE, client, json_of, pose_pb, row};
use crate::support::plain_set::{PlainSet, up};

fn map() -> MapName {
    MapName::new("a").unwrap()
}

async fn client_of(daemon: &Daemon) -> Client {
    Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap()
}

/// A box of 0.1 m cells, from a corner's center to another's.
fn cells(min: [i32; 3], max: [i32; 3]) -> Region {
    let center = |i: i32| (f64::from(i) + 0.5) * 0.1;
    Region::cuboid(min.map(center), max.map(center)).unwrap()
}

fn dense(region: Region, cap_m: Option<f64>) -> BlockRequest {
    BlockRequest { level: 0, form: BlockForm::Dense { region, cap_m } }
}

fn sparse(level: u32, region: Option<Region>) -> BlockRequest {
    BlockRequest { level, form: BlockForm::Sparse { region } }
}

fn distances_of(answer: BlockAnswer) -> DistanceBlock {
    match answer.voxels {
        BlockVoxels::Dense(block) => block,
        BlockVoxels::Sparse(_) => panic!("masks, where distances were asked for"),
    }
}

fn voxels_of(answer: &BlockAnswer) -> PlainSet {
    match &answer.voxels {
        BlockVoxels::Sparse(blocks) => blocks.to_set().unwrap().iter().map(|voxel| voxel.index()).collect(),
        BlockVoxels::Dense(_) => panic!("distances, where masks were asked for"),
    }
}

async fn get_bytes(daemon: &Daemon, path: &str) -> Response {
    let get = client().get(daemon.url(path)).header("accept", "application/octet-stream");
    let answer = get.send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    answer
}

fn header<'a>(answer: &'a Response, name: &str) -> &'a str {
    answer.headers()[name].to_str().unwrap()
}

/// Cells of the test's box: three layers of a row of ten voxels, which begins at the origin.
const MIN: [i32; 3] = [-3, -1, -1];
const MAX: [i32; 3] = [12, 1, 2];

fn distance(cell: [i32; 3], cap: u64) -> u64 {
    let to = |x: i32| {
        let twice = |i: u32| (2 * u64::from(i)).saturating_sub(1).pow(2);
        twice(cell[0].abs_diff(x)) + twice(cell[1].unsigned_abs()) + twice(cell[2].unsigned_abs())
    };
    (0..10).map(to).map(|square| (4 * square).isqrt()).min().unwrap().min(cap)
}

#[tokio::test]
async fn a_dense_block_is_the_same_over_both_protocols_and_from_a_replica() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(10)).await;
    let client = client_of(&daemon).await;
    let replica = Replica::open(client.clone(), map(), ReplicaOptions::default()).await.unwrap();
    for (cap_m, cap) in [(None, 255), (Some(0.11), 5)] {
        let request = dense(cells(MIN, MAX), cap_m);
        let answer = client.get_block(&map(), request).await.unwrap();
        assert_eq!((answer.level, answer.resolution_m, answer.version.revision), (0, 0.1, 1));
        assert_eq!(replica.get_block(&request).unwrap(), answer);
        let version = answer.version;
        let block = distances_of(answer);
        assert_eq!((block.origin, block.size, u64::from(block.cap.get())), (MIN, [16, 3, 4], cap));
        let mut expected = Vec::new();
        for z in MIN[2]..=MAX[2] {
            for y in MIN[1]..=MAX[1] {
                expected.extend((MIN[0]..=MAX[0]).map(|x| distance([x, y, z], cap) as u8));
            }
        }
        assert_eq!(block.distances, expected);

        let cap_m = cap_m.map(|cap_m| format!("&cap_m={cap_m}")).unwrap_or_default();
        let path = format!("/v1/maps/a/block?form=dense&min=-0.26,-0.06,-0.06&max=1.26,0.16,0.26{cap_m}");
        let told = json_of(daemon.get(&path).await).await;
        assert_eq!((&told["origin"], &told["size"]), (&json!(MIN), &json!([16, 3, 4])));
        assert_eq!((&told["cap"], &told["distances"]), (&json!(cap), &json!(expected)));
        assert_eq!(told["revision"], 1);
        let bytes = get_bytes(&daemon, &path).await;
        let of = ["mrol-origin", "mrol-size", "mrol-cap", "mrol-level", "mrol-resolution-m", "mrol-map-uuid"];
        let (cap, uuid) = (cap.to_string(), version.map_uuid.to_string());
        assert_eq!(of.map(|name| header(&bytes, name)), ["-3,-1,-1", "16,3,4", &cap, "0", "0.1", &uuid]);
        assert_eq!(bytes.bytes().await.unwrap(), expected);
    }
}

#[tokio::test]
async fn a_sparse_block_holds_what_a_listing_lists() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(30)).await;
    let client = client_of(&daemon).await;
    let replica = Replica::open(client.clone(), map(), ReplicaOptions::default()).await.unwrap();
    let row: PlainSet = (0..30).map(|i| [i, 0, 0]).collect();
    let ball = Region::ball([1.0, 0.05, 0.05], 0.5).unwrap();
    let turned = mrol::geometry::pose([1.0, 0.05, 0.05], [0.0, 0.0, 0.6, 0.8]).unwrap();
    let turned = Region::oriented_box(turned, [0.9, 0.9, 0.9]).unwrap();
    for level in 0..4 {
        for region in [None, Some(cells([3, -1, -1], [17, 1, 1])), Some(ball), Some(turned)] {
            let request = sparse(level, region);
            let answer = client.get_block(&map(), request).await.unwrap();
            assert_eq!(replica.get_block(&request).unwrap(), answer);
            let listed = client.list_voxels(&map(), ListingRequest::of(level, region)).await.unwrap();
            let keys: PlainSet = listed.keys.iter().map(|key| key.index()).collect();
            assert_eq!(voxels_of(&answer), keys);
            if region.is_none() {
                assert_eq!(keys, row.iter().map(|voxel| up(*voxel, level)).collect());
            }
        }
    }
    let told = json_of(daemon.get("/v1/maps/a/block?level=1").await).await;
    // 15 voxels of 0.2 m in two blocks; of a block's mask byte n holds the cells 2 x 2 x 2 from (2 n) on.
    let blocks = told["blocks"].as_array().unwrap();
    assert_eq!(
        blocks.iter().map(|block| &block["block"]).collect::<Vec<_>>(),
        [&json!([0, 0, 0]), &json!([1, 0, 0])]
    );
    let first = blocks[0]["mask"].as_str().unwrap();
    assert_eq!((first.len(), &first[..4], &first[16..20]), (128, "0303", "0303"));
    let bytes = get_bytes(&daemon, "/v1/maps/a/block?level=1").await;
    assert_eq!((header(&bytes, "mrol-level"), header(&bytes, "mrol-resolution-m")), ("1", "0.2"));
    let bytes = bytes.bytes().await.unwrap();
    assert_eq!((bytes.len(), &bytes[..16]), (144, &[0, 0, 0, 0, 0, 0, 0, 0, 3, 3, 0, 0, 0, 0, 0, 0][..]));
    let nothing = json_of(daemon.get("/v1/maps/a/block?min=5,5,5&max=6,6,6").await).await;
    assert_eq!(nothing["blocks"], json!([]));
}

#[tokio::test]
async fn a_replica_of_a_region_gives_out_what_it_has_all_of() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(30)).await;
    let region = Some(Region::cuboid([0.0, -0.5, -0.5], [1.6, 0.5, 0.5]).unwrap());
    let client = client_of(&daemon).await;
    let options = ReplicaOptions { region, ..ReplicaOptions::default() };
    let part = Replica::open(client.clone(), map(), options).await.unwrap();
    // Within two cells of the border all is known; distances reach one cell with this cap.
    let inside = cells([1, -4, -4], [14, 3, 3]);
    for request in [dense(inside, Some(0.1)), sparse(0, Some(inside)), sparse(2, Some(inside))] {
        let (own, theirs) = (part.get_block(&request), client.get_block(&map(), request).await.unwrap());
        let own = own.unwrap();
        assert_eq!((own.voxels, own.version.content_hash), (theirs.voxels, None));
    }
    let wide = cells([0, -5, -5], [15, 4, 4]);
    for request in [dense(wide, Some(0.1)), dense(inside, None), sparse(3, Some(wide)), sparse(0, None)] {
        let refused = part.get_block(&request).unwrap_err().to_string();
        assert!(refused.contains("must lie in the region that the replica copies"), "{request:?}: {refused}");
    }
    let refused = part.get_block(&sparse(4, Some(inside))).unwrap_err().to_string();
    assert!(refused.contains("level must lie in 0..=3, got 4"), "{refused}");
}

#[tokio::test]
async fn blocks_are_bounded_to_the_last_cell_and_the_limit_is_named() {
    let daemon = Daemon::start_with(|config| {
        config.limits.block_bytes_max = 216;
        config.limits.block_cells_max = 512;
    })
    .await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(32)).await;
    let client = client_of(&daemon).await;
    // 6 x 6 x 6 cells of 216 bytes, and 8 x 8 x 8 with one more on each side; 24 voxels in three blocks.
    let (cube, three) = (cells([0; 3], [5; 3]), cells([0; 3], [23, 0, 0]));
    for request in [dense(cube, Some(0.1)), sparse(0, Some(three))] {
        client.get_block(&map(), request).await.unwrap();
    }
    for (request, words) in [
        (sparse(0, None), "block_bytes_max is 216"),
        (dense(cells([0; 3], [6, 5, 5]), Some(0.1)), "252 bytes or more, block_bytes_max is 216"),
        (dense(cube, Some(0.2)), "1000 cells, block_cells_max is 512"),
        (dense(Region::cuboid([-1e300; 3], [1e300; 3]).unwrap(), None), "block_bytes_max is 216"),
    ] {
        let refused = client.get_block(&map(), request).await.unwrap_err().to_string();
        assert!(refused.contains(words) && refused.contains("block_too_large"), "{refused}");
    }
    let answer = daemon.get("/v1/maps/a/block").await;
    assert_eq!(answer.status(), StatusCode::TOO_MANY_REQUESTS);
    assert_eq!(json_of(answer).await["reason"], "block_too_large");
}

#[tokio::test]
async fn requests_for_no_block_are_refused_by_name() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    for (params, reason, words) in [
        ("form=dense", "missing_field", "min and max"),
        ("form=thick", "bad_query", "\"sparse\" or \"dense\""),
        ("form=dense&min=0,0,0", "half_a_box", "min and max"),
        ("form=dense&min=0,0,0&max=1,1,inf", "bad_region", "finite sides"),
        ("form=dense&map_from_box=0,0,0,0,0,0,1&size=1,1,1", "bad_region", "must be a box"),
        ("form=dense&min=0,0,0&max=1,1,1&cap_m=0", "bad_cap", "more than 0 meters, got 0"),
        ("form=dense&min=0,0,0&max=1,1,1&cap_m=NaN", "bad_cap", "got NaN"),
        ("form=dense&min=0,0,0&max=1,1,1&cap_m=x", "bad_query", "cap_m"),
        ("cap_m=1", "unexpected_field", "form=dense"),
        ("level=4", "level_out_of_range", "0..=3"),
        ("min=0,0,0&max=1,1", "bad_numbers", "max"),
    ] {
        let answer = daemon.get(&format!("/v1/maps/a/block?{params}")).await;
        assert_eq!(answer.status(), StatusCode::BAD_REQUEST, "{params}");
        let error = json_of(answer).await;
        assert_eq!(error["reason"], reason, "{params}: {error}");
        assert!(error["detail"].as_str().unwrap().contains(words), "{params}: {error}");
    }
    let refused = |request| async { daemon.occupancy().await.get_block(request).await.unwrap_err() };
    let base = pb::GetBlockRequest { map: "a".into(), ..Default::default() };
    let dense = Some(pb::DenseForm::default());
    let status = refused(pb::GetBlockRequest { dense, ..base.clone() }).await;
    assert!(status.message().contains("region of a dense block is missing"), "{status}");
    let region = Some(pb::Region::from(Region::ball([0.0; 3], 1.0).unwrap()));
    let status = refused(pb::GetBlockRequest { dense, region, ..base.clone() }).await;
    assert!(status.message().contains("must be a box"), "{status}");
    let status = refused(pb::GetBlockRequest { map: "b".into(), ..base }).await;
    assert_eq!(status.code(), tonic::Code::NotFound);
}

/// A camera in the middle of the row that looks along it: z along x, y down.
fn view() -> Frustum {
    let along_x = mrol::geometry::pose([1.0, 0.05, 0.05], [-0.5, 0.5, -0.5, 0.5]).unwrap();
    Frustum::new(along_x, [0.5, 0.5], [0.2, 1.0]).unwrap()
}

#[tokio::test]
async fn a_camera_lists_and_counts_what_it_sees() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(30)).await;
    let client = client_of(&daemon).await;
    let seen: BTreeSet<i32> = (12..20).collect();
    let selection = VoxelSelection { view: Some(view()), region: None };
    let listing =
        client.list_voxels(&map(), ListingRequest { selection, ..Default::default() }).await.unwrap();
    assert_eq!(listing.keys.iter().map(|key| key.index()[0]).collect::<BTreeSet<_>>(), seen);
    assert_eq!(listing.voxels_total, 8);
    let params = "map_from_camera=1,0.05,0.05,-0.5,0.5,-0.5,0.5&fov=0.5,0.5&range=0.2,1";
    let told = json_of(daemon.get(&format!("/v1/maps/a/voxels?{params}")).await).await;
    assert_eq!((told["voxels"].as_array().unwrap().len(), &told["voxels_total"]), (8, &json!(8)));
    // Of those in a box as well.
    let both = VoxelSelection { region: Some(cells([0, -1, -1], [14, 1, 1])), ..selection };
    for (selection, params, count) in [
        (VoxelSelection::default(), "", 30),
        (selection, params, 8),
        (both, &format!("{params}&min=0,-1,-1&max=1.5,1,1"), 3),
    ] {
        let request = ListingRequest { selection, count_only: true, ..ListingRequest::default() };
        let counted = client.list_voxels(&map(), request).await.unwrap();
        assert_eq!((counted.voxels_total, counted.keys.len(), counted.version.revision), (count, 0, 1));
        let told = json_of(daemon.get(&format!("/v1/maps/a/voxels?count_only=true&{params}")).await).await;
        assert_eq!((&told["voxels_total"], &told["voxels"]), (&json!(count), &Value::Null));
    }
}

#[tokio::test]
async fn what_may_not_be_listed_may_be_counted() {
    let daemon = Daemon::start_with(|config| config.limits.listed_voxels_max = 7).await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(30)).await;
    let told = json_of(daemon.get("/v1/maps/a/voxels").await).await;
    assert_eq!(told["reason"], "listing_too_large");
    let told = json_of(daemon.get("/v1/maps/a/voxels?count_only=true&level=1").await).await;
    assert_eq!((&told["voxels_total"], &told["resolution_m"]), (&json!(15), &json!(0.2)));
}

#[tokio::test]
async fn a_view_that_no_camera_has_is_refused_by_name() {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    let of = |fov: &str, range: &str| format!("map_from_camera=0,0,0,0,0,0,1&fov={fov}&range={range}");
    for (params, reason) in [
        (of("0,1", "0,1"), "bad_view"),
        (of("1,3.2", "0,1"), "bad_view"),
        (of("NaN,1", "0,1"), "bad_view"),
        (of("1,1", "1,1"), "bad_view"),
        (of("1,1", "2,1"), "bad_view"),
        (of("1,1", "-1,1"), "bad_view"),
        (of("1,1", "0,inf"), "bad_view"),
        (of("1,1", "0,NaN"), "bad_view"),
        (of("1", "0,1"), "bad_numbers"),
        ("map_from_camera=0,0,0,0,0,0,2&fov=1,1&range=0,1".to_owned(), "bad_pose"),
        ("fov=1,1&range=0,1".to_owned(), "missing_field"),
        ("count_only=maybe".to_owned(), "bad_query"),
    ] {
        let answer = daemon.get(&format!("/v1/maps/a/voxels?{params}")).await;
        assert_eq!(answer.status(), StatusCode::BAD_REQUEST, "{params}");
        let error = json_of(answer).await;
        assert_eq!(error["reason"], reason, "{params}: {error}");
    }
    let view = pb::View {
        map_from_camera: Some(pose_pb([0.0; 3])),
        horizontal_rad: 1.0,
        vertical_rad: f64::NAN,
        near_m: 0.0,
        far_m: 1.0,
    };
    let request = pb::ListVoxelsRequest { map: "a".into(), view: Some(view), ..Default::default() };
    let status = daemon.occupancy().await.list_voxels(request).await.unwrap_err();
    assert!(status.message().contains("view: horizontal_rad and vertical_rad"), "{status}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_large_block_whose_caller_has_gone_is_given_up() {
    let daemon = Daemon::start_with(|config| {
        config.threads.query = 2;
        config.limits.block_cells_max = 1 << 30;
        config.limits.block_bytes_max = 30 << 20;
    })
    .await;
    daemon.make_map("a").await;
    // A voxel in nearly every row of the block, so that no row can be skipped.
    let scattered = |i: u32| {
        [(i % 299) as f32 * 0.1 + 0.05, (i / 300) as f32 * 0.1 + 0.05, (i % 300) as f32 * 0.1 + 0.05]
    };
    daemon.put_in("a", &(0..90_000).map(scattered).collect::<Vec<_>>()).await;
    let query = async |what: &str| daemon.metric(&format!("mrol_jobs_{what}{{pool=\"blocks\"}}")).await;
    let cancelled = query("cancelled_total").await.unwrap();
    let url = daemon.url("/v1/maps/a/block?form=dense&min=0,0,0&max=30,30,30");
    let gone = tokio::spawn(client().get(url).send());
    let begin = Instant::now();
    while query("running").await != Some(1.0) {
        assert!(begin.elapsed() < PATIENCE, "it is not begun");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    gone.abort();
    let begin = Instant::now();
    while query("cancelled_total").await != Some(cancelled + 1.0) || query("running").await != Some(0.0) {
        assert!(begin.elapsed() < PATIENCE, "it is not given up");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}
