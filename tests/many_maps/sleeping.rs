//! More maps than there is room for: they come and go, answers are right, and a `kill -9` meanwhile loses nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use mrol::client::{Client, NewMap};
use mrol::geometry::Point;
use mrol::map::Lookup;
use mrol::service::PointQuery;
use rand::RngExt;
use rand::SeedableRng;
use rand::rngs::StdRng;
use tokio::time::sleep;

use crate::support::memory::Memory;
use crate::{Server, name, number_of, scan};

/// Maps that there is room for.
const ROOM: usize = 50;
/// Bytes a voxel of a map in memory, twice what is measured of such sheets: what was freed is given back after a while.
const VOXEL_BYTES: usize = 64;
/// What the server takes for its work, besides its maps.
const BESIDES: usize = 160 << 20;
const SLEEP: [(&str, &str); 1] = [("MROL_MAPS__SLEEP_AFTER_S", "1")];
/// Clients that ask at once.
const CLIENTS: usize = 2;
const PATIENCE: Duration = Duration::from_secs(120);

/// The place of a map's sheet, and the points of it: no two maps have one in common.
fn sheet(map: usize, voxels: usize) -> Vec<Point> {
    let side = voxels.isqrt().max(1);
    (0..voxels)
        .map(|i| Point::new((i % side) as f32 * 0.1 + 0.05, (i / side) as f32 * 0.1 + 0.05, height(map)))
        .collect()
}

fn height(map: usize) -> f32 {
    map as f32 * 0.1 + 0.05
}

fn all_of(points: Vec<Point>) -> PointQuery {
    PointQuery {
        points: points.into(),
        map_from_points: None,
        level: 0,
        lookup: Lookup::Exact,
        min_revision: None,
        map_uuid: None,
        keep_out: false,
    }
}

/// The point that a scan adds to its map.
fn mark(map: usize, scan_id: u64) -> Point {
    Point::new(-1.05 - scan_id as f32 * 0.1, -0.95, height(map))
}

/// What the clients did with each map.
struct Maps {
    voxels: usize,
    /// Scans that were acknowledged, the sheet first.
    acknowledged: Vec<AtomicU64>,
    /// One client at a time changes a map.
    changing: Vec<tokio::sync::Mutex<()>>,
    first_touches_ms: parking_lot::Mutex<Vec<f64>>,
    answers: AtomicUsize,
    over: AtomicBool,
}

impl Maps {
    /// Asks for the sheet of another map and its own, and for the marks that were acknowledged.
    async fn check(&self, client: &Client, map: usize) {
        let known = self.acknowledged[map].load(Ordering::Acquire);
        let other = (map + 1) % self.acknowledged.len();
        let corner = |map: usize| sheet(map, self.voxels)[0];
        let marks = (1..known).map(|scan_id| mark(map, scan_id));
        let points: Vec<Point> = [corner(map), corner(other)].into_iter().chain(marks).collect();
        let expected = points.len() - 1;
        let answer = client.query_points(&name(map), all_of(points)).await.unwrap();
        assert_eq!(answer.points_occupied, expected, "map {map} after {known} scans");
        assert!(answer.version.revision >= known, "map {map} at {} of {known}", answer.version.revision);
        self.answers.fetch_add(1, Ordering::Relaxed);
    }

    /// Inserts the next scan; false where the server has gone.
    async fn mark(&self, client: &Client, map: usize) -> bool {
        let _changing = self.changing[map].lock().await;
        let scan_id = self.acknowledged[map].load(Ordering::Acquire);
        match client.insert_scan(&name(map), scan(scan_id, vec![mark(map, scan_id)])).await {
            Ok(answer) => {
                assert!(answer.accepted && answer.version.revision == scan_id + 1, "map {map}: {answer:?}");
                self.acknowledged[map].store(scan_id + 1, Ordering::Release);
                true
            }
            Err(error) => {
                assert!(self.over.load(Ordering::Acquire), "map {map}: {error}");
                false
            }
        }
    }
}

/// Asks for maps at random, and changes some, until the time is up or the server has gone.
async fn ask_and_change(maps: Arc<Maps>, client: Client, seed: u64, until: Instant) {
    let mut random = StdRng::seed_from_u64(seed);
    while Instant::now() < until && !maps.over.load(Ordering::Acquire) {
        let map = random.random_range(0..maps.acknowledged.len());
        let start = Instant::now();
        if random.random_range(0..4) == 0 {
            if !maps.mark(&client, map).await {
                return;
            }
        } else {
            maps.check(&client, map).await;
        }
        maps.first_touches_ms.lock().push(start.elapsed().as_secs_f64() * 1000.0);
        // As many maps are awake as are asked for within the time after which they sleep, and a little more.
        sleep(Duration::from_millis(100 * CLIENTS as u64)).await;
    }
}

/// Waits until all maps sleep.
async fn until_all_sleep(client: &Client) {
    let start = Instant::now();
    while client.list_maps().await.unwrap().maps.iter().any(|map| !map.is_asleep) {
        assert!(start.elapsed() < PATIENCE, "maps stay awake that nobody uses");
        sleep(Duration::from_millis(100)).await;
    }
}

/// The most that is resident, looked at every now and then.
async fn peak_of(memory: Memory, maps: Arc<Maps>) -> usize {
    let mut peak = 0;
    while !maps.over.load(Ordering::Acquire) {
        peak = memory.resident().max(peak);
        sleep(Duration::from_millis(50)).await;
    }
    peak
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn more_maps_than_there_is_room_for_come_and_go() {
    let (count, voxels) = (number_of("MROL_SLEEPING_MAPS", 100), number_of("MROL_SLEEPING_VOXELS", 1000));
    let seconds = number_of("MROL_SLEEPING_SECONDS", 6) as u64;
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(&data, &SLEEP).await;
    let at_rest = server.memory.resident();
    let maps = Arc::new(Maps {
        voxels,
        acknowledged: (0..count).map(|_| AtomicU64::new(1)).collect(),
        changing: (0..count).map(|_| tokio::sync::Mutex::default()).collect(),
        first_touches_ms: parking_lot::Mutex::default(),
        answers: AtomicUsize::new(0),
        over: AtomicBool::new(false),
    });
    for map in 0..count {
        server.client.create_map(&name(map), NewMap::of(0.1)).await.unwrap();
        let made = server.client.insert_scan(&name(map), scan(0, sheet(map, voxels))).await.unwrap();
        assert!(made.accepted && made.new_voxels as usize == voxels, "{made:?}");
    }
    until_all_sleep(&server.client).await;

    // Asked and changed, until it is killed in the middle of that.
    let peak = tokio::spawn(peak_of(Memory::of(server.process.id()), Arc::clone(&maps)));
    let until = Instant::now() + Duration::from_secs(seconds);
    let clients: Vec<_> = (0..CLIENTS as u64)
        .map(|seed| tokio::spawn(ask_and_change(Arc::clone(&maps), server.client.clone(), seed, until)))
        .collect();
    for client in clients {
        client.await.unwrap();
    }
    let writers: Vec<_> = (0..count.min(20))
        .map(|map| {
            let (maps, client) = (Arc::clone(&maps), server.client.clone());
            tokio::spawn(async move { while maps.mark(&client, map).await {} })
        })
        .collect();
    sleep(Duration::from_millis(1500)).await;
    maps.over.store(true, Ordering::Release);
    server.process.kill();
    for writer in writers {
        writer.await.unwrap();
    }
    let peak = peak.await.unwrap().saturating_sub(at_rest);
    let bound = ROOM * voxels * VOXEL_BYTES + BESIDES;
    assert!(
        peak <= bound,
        "{peak} bytes for {count} maps of {voxels} voxels, {bound} would be room for {ROOM}"
    );

    // All that was acknowledged is there, and the last scan that was not may be.
    let server = Server::start(&data, &SLEEP).await;
    for map in 0..count {
        maps.check(&server.client, map).await;
        let (known, info) = (
            maps.acknowledged[map].load(Ordering::Acquire),
            server.client.map_info(&name(map)).await.unwrap(),
        );
        assert!(
            (known..=known + 1).contains(&info.version.revision),
            "map {map}: {} of {known}",
            info.version.revision
        );
    }
    until_all_sleep(&server.client).await;
    let mut touches = maps.first_touches_ms.lock().clone();
    touches.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| touches.get((touches.len() as f64 * share) as usize).copied().unwrap_or_default();
    println!(
        "{count} maps of {voxels} voxels: peak {} MiB above rest, {} answers; touches of maps that mostly slept: \
         median {:.1} ms, p99 {:.1} ms, longest {:.1} ms",
        peak >> 20,
        maps.answers.load(Ordering::Relaxed),
        at(0.5),
        at(0.99),
        touches.last().copied().unwrap_or_default()
    );
    assert_eq!(server.process.stop(), Some(0));
}
