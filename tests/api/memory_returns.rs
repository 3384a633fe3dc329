//! Memory of a map that was deleted goes back to the system, though nobody asks for anything afterwards.

#![cfg(target_os = "linux")]

use std::time::{Duration, Instant};

use mrol::client::{Client, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::ScanRequest;

use crate::support::memory::Memory;
use crate::support::process::Process;

/// Points of a scan.
const POINTS: usize = 100_000;
/// Generous: a second would do.
const PATIENCE: Duration = Duration::from_secs(60);

/// Points each in a block of its own, as hardly any surface has them: a map of 500 bytes a point.
fn scattered(scan: usize) -> Vec<Point> {
    let place = |n: usize| (n % 1000) as f32 + 0.5;
    (scan * POINTS..(scan + 1) * POINTS)
        .map(|i| Point::new(place(i), place(i / 1000), place(i / 1_000_000)))
        .collect()
}

#[tokio::test]
async fn a_deleted_map_leaves_memory() {
    let data = tempfile::tempdir().unwrap();
    let server = Process::start(data.path().to_str().unwrap(), &[]);
    let (memory, client) = (Memory::of(server.id()), Client::connect(&server.grpc).await.unwrap());
    let (map, robot) = (MapName::new("large").unwrap(), RobotName::new("r1").unwrap());
    let at_rest = memory.resident();

    client.create_map(&map, NewMap::of(0.1)).await.unwrap();
    for scan in 0..3 {
        let scan = ScanRequest {
            guess: Guess::Pose(Pose::identity()),
            at_guess: true,
            ..ScanRequest::new(robot.clone(), scattered(scan).into())
        };
        assert!(client.insert_scan(&map, scan).await.unwrap().accepted);
    }
    let of_map = memory.resident() - at_rest;
    assert!(of_map > 100 << 20, "{of_map} bytes");
    client.delete_map(&map).await.unwrap();

    let start = Instant::now();
    while memory.resident() > at_rest + of_map / 2 {
        let still = memory.resident() - at_rest;
        assert!(start.elapsed() < PATIENCE, "{still} of {of_map} bytes are still there");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    assert_eq!(server.stop(), Some(0));
}
