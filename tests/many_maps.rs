//! Many small maps: what each takes of memory and threads, and that they are there again after a restart.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod support;

use mrol::client::{Client, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::ScanRequest;

use crate::support::memory::Memory;
use crate::support::process::Process;

/// Maps that are made.
const MAPS: usize = 400;
/// Bytes that an empty map may take, and one with a scan of a few points.
const EMPTY_MAP_BYTES_MAX: usize = 100 << 10;
const SMALL_MAP_BYTES_MAX: usize = 200 << 10;
/// Threads that may come with maps, however many: of a machine with few cores.
const THREADS_BESIDES: usize = 40;

fn name(number: usize) -> MapName {
    MapName::new(&format!("tile-{number}")).unwrap()
}

async fn server(data: &tempfile::TempDir) -> (Process, Memory, Client) {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_mrol"));
    command
        .args(["serve", "--json", "--log-level", "error", "--data-dir", data.path().to_str().unwrap()])
        .args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"])
        .env("MROL_LIMITS__MAPS_MAX", "1000")
        .env("MROL_LOG__AUDIT", "false");
    let server = Process::of(command);
    let (memory, client) = (Memory::of(server.id()), Client::connect(&server.grpc).await.unwrap());
    (server, memory, client)
}

async fn insert_small(client: &Client, map: &MapName) {
    let points: Vec<Point> = (0..20).map(|i| Point::new(i as f32 * 0.1, 1.0, 0.5)).collect();
    let scan = ScanRequest {
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("r1").unwrap(), points.into())
    };
    assert!(client.insert_scan(map, scan).await.unwrap().accepted);
}

#[tokio::test]
async fn a_small_map_takes_little_memory_and_no_thread() {
    let data = tempfile::tempdir().unwrap();
    let (first, memory, client) = server(&data).await;
    let (threads, at_rest) = (memory.threads(), memory.resident());
    for number in 0..MAPS {
        client.create_map(&name(number), NewMap::of(0.1)).await.unwrap();
    }
    let of_empty = memory.resident().saturating_sub(at_rest) / MAPS;
    assert!(of_empty <= EMPTY_MAP_BYTES_MAX, "{of_empty} bytes an empty map");
    for number in 0..MAPS {
        insert_small(&client, &name(number)).await;
    }
    let of_small = memory.resident().saturating_sub(at_rest) / MAPS;
    assert!(of_small <= SMALL_MAP_BYTES_MAX, "{of_small} bytes a map of a few voxels");
    let come = memory.threads().saturating_sub(threads);
    assert!(come <= THREADS_BESIDES, "{come} threads for {MAPS} maps");
    println!("{of_empty} bytes an empty map, {of_small} a small one, {come} threads for {MAPS} maps");
    first.kill();

    let (again, memory, client) = server(&data).await;
    let maps = client.list_maps().await.unwrap().maps;
    assert_eq!(maps.len(), MAPS);
    assert!(maps.iter().all(|map| map.version.revision == 1 && map.scans == 1));
    let of_small = memory.resident().saturating_sub(at_rest) / MAPS;
    assert!(of_small <= SMALL_MAP_BYTES_MAX, "{of_small} bytes a map of a few voxels after a restart");
    println!("{of_small} bytes a small one after a restart");
    assert_eq!(again.stop(), Some(0));
}
