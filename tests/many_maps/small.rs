//! What a small map takes of memory and threads, and how soon many are served again.

use std::net::TcpListener;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use mrol::client::NewMap;
use mrol::geometry::Point;
use reqwest::StatusCode;
use tempfile::TempDir;

use crate::support::memory::Memory;
use crate::{Server, name, number_of, scan, serve};

/// Bytes that an empty map may take, and one with a scan of a few points.
const EMPTY_MAP_BYTES_MAX: usize = 100 << 10;
const SMALL_MAP_BYTES_MAX: usize = 200 << 10;
/// Generous: less than a second would do.
const PATIENCE: Duration = Duration::from_secs(60);
/// Threads that may come with maps, however many they are.
const THREADS_BESIDES: usize = 60;

#[tokio::test]
async fn a_small_map_takes_little_memory_and_no_thread() {
    let maps = number_of("MROL_SMALL_MAPS", 800);
    let data = tempfile::tempdir().unwrap();
    let Server { process, memory, client } = Server::start(&data, &[]).await;
    let (threads, at_rest) = (memory.threads(), memory.resident());
    for number in 0..maps {
        client.create_map(&name(number), NewMap::of(0.1)).await.unwrap();
    }
    let of_empty = memory.resident().saturating_sub(at_rest) / maps;
    assert!(of_empty <= EMPTY_MAP_BYTES_MAX, "{of_empty} bytes an empty map");
    let points: Vec<Point> = (0..20).map(|i| Point::new(i as f32 * 0.1, 1.0, 0.5)).collect();
    for number in 0..maps {
        assert!(client.insert_scan(&name(number), scan(0, points.clone())).await.unwrap().accepted);
    }
    let of_small = memory.resident().saturating_sub(at_rest) / maps;
    assert!(of_small <= SMALL_MAP_BYTES_MAX, "{of_small} bytes a map of a few voxels");
    let come = memory.threads().saturating_sub(threads);
    assert!(come <= THREADS_BESIDES, "{come} threads for {maps} maps");
    println!("{maps} maps: {of_empty} bytes an empty map, {of_small} one of a few voxels, {come} threads");
    process.kill();

    let (first, last) = opened_again(&data, maps).await;
    println!("restarted: first answer of a map after {first:?}, all {maps} open after {last:?}");
    let Server { process, memory, client } = Server::start(&data, &[]).await;
    let listed = client.list_maps().await.unwrap().maps;
    assert_eq!(listed.len(), maps);
    assert!(listed.iter().all(|map| map.version.revision == 1 && map.scans == 1));
    let of_small = memory.resident().saturating_sub(at_rest) / maps;
    assert!(of_small <= SMALL_MAP_BYTES_MAX, "{of_small} bytes a map of a few voxels after a restart");
    println!("restarted: {of_small} bytes a map of a few voxels, {} threads", memory.threads());
    // Saving thousands of maps may take longer than the test is to.
    process.kill();
}

/// How long a new server takes until a map is answered for, and until it is ready.
async fn opened_again(data: &TempDir, maps: usize) -> (Duration, Duration) {
    // Its first line comes when all are open; the port is known before.
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut command = serve(data, &format!("127.0.0.1:{port}"), &[]);
    let start = Instant::now();
    let server = Ended(command.stdout(Stdio::null()).spawn().unwrap());
    let (client, at) = (reqwest::Client::new(), format!("http://127.0.0.1:{port}"));
    let ask = async |path: String| {
        client.get(format!("{at}{path}")).send().await.ok().map(|answer| answer.status())
    };
    // The one that would be opened last.
    let path = format!("/v1/maps/{}", name(maps - 1));
    while ask(path.clone()).await != Some(StatusCode::OK) {
        assert!(start.elapsed() < PATIENCE, "it does not answer");
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    let first = start.elapsed();
    while ask("/readyz".into()).await != Some(StatusCode::OK) {
        assert!(start.elapsed() < PATIENCE, "it does not answer");
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    assert!(Memory::of(server.0.id()).threads() > 0);
    (first, start.elapsed())
}

/// A server that ends with the test.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
