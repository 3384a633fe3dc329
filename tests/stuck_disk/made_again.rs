//! A map that is deleted and made again while its snapshot is written, which takes long: nothing of the old one comes
//! into the new one.

use std::path::Path;
use std::time::{Duration, Instant};

use mrol::client::{Client, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::{ListingRequest, ScanRequest};
use mrol::voxel::VoxelKey;
use uuid::Uuid;

use crate::support::daemon::row;
use crate::support::disk::Disk;
use crate::support::skipped::skipped;

/// Of the scan that is in the old map. The new one's first file has another number.
const OLD_SNAPSHOT: &str = "snapshot-00000000000000000001";
const PATIENCE: Duration = Duration::from_secs(60);
/// For a snapshot that should not be written to be written.
const MOMENT: Duration = Duration::from_secs(2);

fn depot() -> MapName {
    MapName::new("depot").unwrap()
}

/// Makes the map with one scan in it; its uuid.
async fn make(client: &Client, voxels: usize) -> Uuid {
    client.create_map(&depot(), NewMap::of(0.1)).await.unwrap();
    let points: Vec<Point> = row(voxels).into_iter().map(Point::from).collect();
    let scan = ScanRequest {
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("r1").unwrap(), points.into())
    };
    let answer = client.insert_scan(&depot(), scan).await.unwrap();
    assert_eq!(answer.version.revision, 1);
    answer.version.map_uuid
}

async fn wait_until(patience: Duration, mut there: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while !there() {
        if start.elapsed() > patience {
            return false;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    true
}

fn has_snapshot(maps: &Path) -> bool {
    let folders = std::fs::read_dir(maps).unwrap().map(|entry| entry.unwrap().path());
    folders.filter(|path| path.is_dir()).any(|folder| folder.join(format!("{OLD_SNAPSHOT}.mrol")).exists())
}

#[tokio::test]
async fn a_snapshot_that_hangs_does_not_bring_a_deleted_map_back() {
    let Some(disk) = Disk::build() else {
        skipped("there is no `cc` to build a disk that hangs with");
        return;
    };
    let server = crate::server(&disk);
    let client = Client::connect(&server.grpc).await.unwrap().with_timeout(PATIENCE);
    disk.hang(OLD_SNAPSHOT);
    make(&client, 40).await;
    assert!(wait_until(PATIENCE, || disk.somebody_waits()).await, "no snapshot is written");
    // A deletion that waits for the snapshot is as good as one that does not, if nothing of the old map is left.
    let deleting = tokio::spawn({
        let client = client.clone();
        async move { client.delete_map(&depot()).await }
    });
    let is_deleted = wait_until(MOMENT, || deleting.is_finished()).await;
    if !is_deleted {
        disk.go_on();
    }
    deleting.await.unwrap().unwrap();
    let uuid = make(&client, 7).await;
    if is_deleted {
        disk.go_on();
    }
    wait_until(MOMENT, || has_snapshot(&disk.folder().join("maps"))).await;
    server.kill();

    let server = crate::server(&disk);
    let client = Client::connect(&server.grpc).await.unwrap();
    let listing = client.list_voxels(&depot(), ListingRequest::default()).await.unwrap();
    assert_eq!((listing.version.map_uuid, listing.version.revision), (uuid, 1), "another map");
    let mut expected: Vec<VoxelKey> = (0..7).map(|x| VoxelKey::new([x, 0, 0]).unwrap()).collect();
    let mut found = listing.keys;
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected);
    assert_eq!(server.stop(), Some(0));
}
