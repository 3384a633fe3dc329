//! A keep-out whose time is up ends while a snapshot of another map hangs.

use std::time::{Duration, Instant, SystemTime};

use mrol::client::{Client, NewMap};
use mrol::map::{KeepOutName, KeepOutShape, MapName, Region};
use mrol::service::PutKeepOut;

use crate::support::disk::Disk;
use crate::support::skipped::skipped;

const PATIENCE: Duration = Duration::from_secs(60);
/// Until the keep-out's time is up.
const LIFETIME: Duration = Duration::from_secs(2);

fn soon() -> i64 {
    let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap();
    (since_epoch + LIFETIME).as_nanos() as i64
}

async fn put(client: &Client, map: &MapName, expires_at_ns: Option<i64>) {
    let shape = KeepOutShape::of_region(Region::ball([0.0; 3], 1.0).unwrap()).unwrap();
    let name = KeepOutName::new("dock").unwrap();
    let put = PutKeepOut { name, shape, expires_at_ns, request_id: None };
    client.put_keep_out(map, put).await.unwrap();
}

#[tokio::test]
async fn a_keep_out_ends_at_its_time_though_the_snapshot_of_another_map_hangs() {
    let Some(disk) = Disk::build() else {
        skipped("there is no `cc` to build a disk that hangs with");
        return;
    };
    let server = crate::server(&disk);
    let client = Client::connect(&server.grpc).await.unwrap().with_timeout(PATIENCE);
    let [hung, free] = crate::MAPS.map(|name| MapName::new(name).unwrap());
    for map in [&hung, &free] {
        client.create_map(map, NewMap::of(0.1)).await.unwrap();
    }
    put(&client, &hung, None).await;
    // Nothing is written of it from now on but its snapshot.
    disk.hang("/hung.");
    let start = Instant::now();
    while !disk.somebody_waits() {
        assert!(start.elapsed() < PATIENCE, "no snapshot is written");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    put(&client, &free, Some(soon())).await;
    let start = Instant::now();
    while !client.list_keep_outs(&free).await.unwrap().keep_outs.is_empty() {
        assert!(start.elapsed() < PATIENCE, "it does not end");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    disk.go_on();
    assert_eq!(server.stop(), Some(0));
}
