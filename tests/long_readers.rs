//! A map that is listed all the time, while parts of it are deleted and inserted again: queries are answered at once
//! all the same. Then all of it is deleted at once.
//!
//! CI takes a million voxels for 5 s and asks that everything goes on. The long form takes 20 million for two minutes,
//! and percentiles:
//!
//!     MROL_LONG_READERS_SECONDS=120 cargo test --release --test long_readers -- --nocapture

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod support;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use mrol::geometry::{Point, Pose};
use mrol::map::{Lookup, MapContents, MapName, MapSettings, Region, RobotName};
use mrol::mapping::Guess;
use mrol::service::{
    Deletion, DeletionTarget, Limits, ListingRequest, MapService, PointQuery, ScanRequest, ServiceSettings,
};
use mrol::store::{OpeningProgress, Snapshot};
use mrol::voxel::{VoxelKey, VoxelSet};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uuid::Uuid;

use crate::support::watchdog::{Beat, Watchdog};

const RESOLUTION_M: f64 = 0.1;
/// The map is floors, one above the other, of so many voxels in x and in y.
const FLOOR_SIDE: usize = 1000;
const FLOOR_VOXELS: usize = FLOOR_SIDE * FLOOR_SIDE;
/// From floor to floor.
const FLOOR_HEIGHT: usize = 30;
const QUERY_POINTS: usize = 1000;
const QUERY_PAUSE: Duration = Duration::from_millis(2);
const SCAN_POINTS: usize = 10_000;
const STILL_MAX: Duration = Duration::from_secs(60);

const QUERY_MAX: Duration = Duration::from_secs(2);
const QUERY_P99_MAX: Duration = Duration::from_millis(20);
const QUERY_MAX_BESIDE_DELETION: Duration = Duration::from_millis(150);
/// Memory that a deletion takes while it is made.
const DELETION_BYTES_PER_VOXEL_MAX: usize = 8;

/// Counts what is allocated.
struct Counting;

static BYTES: AtomicUsize = AtomicUsize::new(0);
static BYTES_MAX: AtomicUsize = AtomicUsize::new(0);

impl Counting {
    fn add(bytes: usize) {
        let now = BYTES.fetch_add(bytes, Ordering::Relaxed) + bytes;
        BYTES_MAX.fetch_max(now, Ordering::Relaxed);
    }
}

#[expect(unsafe_code, reason = "an allocator is unsafe by its interface")]
// SAFETY: the system's allocator, asked as this one was; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        BYTES.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How large, how long.
struct Size {
    floors: usize,
    duration: Duration,
    /// Floors' columns of which a deletion takes at least, at most; each scan that puts them back brings the least.
    columns: (usize, usize),
    is_long: bool,
}

impl Size {
    fn of_environment() -> Self {
        let long = std::env::var("MROL_LONG_READERS_SECONDS").ok();
        match long.map(|text| text.parse().expect("seconds")) {
            Some(seconds) => Self {
                floors: 20,
                duration: Duration::from_secs(seconds),
                columns: (100, FLOOR_SIDE),
                is_long: true,
            },
            None => Self { floors: 1, duration: Duration::from_secs(5), columns: (10, 11), is_long: false },
        }
    }
}

fn map() -> MapName {
    MapName::new("floors").unwrap()
}

fn point(x: usize, y: usize, floor: usize) -> Point {
    Point::from([x, y, floor * FLOOR_HEIGHT].map(|i| (i as f32 + 0.5) * RESOLUTION_M as f32))
}

/// The map, put into a service.
async fn service(size: &Size, data: &tempfile::TempDir) -> MapService {
    let limits = Limits {
        listed_voxels_max: size.floors * FLOOR_VOXELS,
        map_file_bytes_max: 8 << 30,
        ..Limits::default()
    };
    let settings =
        ServiceSettings { data_dir: Some(data.path().to_owned()), limits, ..ServiceSettings::default() };
    let file = {
        let key = |i: usize| {
            let (floor, rest) = (i / FLOOR_VOXELS, i % FLOOR_VOXELS);
            VoxelKey::new([rest % FLOOR_SIDE, rest / FLOOR_SIDE, floor * FLOOR_HEIGHT].map(|i| i as i32))
        };
        let voxels: VoxelSet = (0..size.floors * FLOOR_VOXELS).filter_map(key).collect();
        let contents = MapContents { revision: 1, voxels, ..MapContents::default() };
        let settings = MapSettings::new(RESOLUTION_M, 4);
        Snapshot { uuid: Uuid::new_v4(), settings, contents }.encode().unwrap()
    };
    let open = move || MapService::open(settings, &OpeningProgress::default()).unwrap();
    let service = tokio::task::spawn_blocking(open).await.unwrap();
    service.restore_map(map(), file.into(), false).await.unwrap();
    service
}

/// One after the other: how long each took, ascending.
async fn queries(service: MapService, floors: usize, enough: Arc<AtomicBool>, heart: Beat) -> Vec<Duration> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut times = Vec::new();
    while !enough.load(Ordering::Relaxed) {
        let mut place = || {
            let (x, y) = (random.random_range(0..FLOOR_SIDE), random.random_range(0..FLOOR_SIDE));
            point(x, y, random.random_range(0..floors))
        };
        let points: Vec<Point> = (0..QUERY_POINTS).map(|_| place()).collect();
        let query = PointQuery {
            points: points.into(),
            map_from_points: None,
            level: 0,
            lookup: Lookup::Exact,
            min_revision: None,
            map_uuid: None,
            keep_out: false,
        };
        let start = Instant::now();
        service.query_points(&map(), query).await.expect("an answer");
        times.push(start.elapsed());
        heart.beat();
        tokio::time::sleep(QUERY_PAUSE).await;
    }
    times.sort_unstable();
    times
}

/// Lists the whole map, again and again; how often.
async fn listings(service: MapService, enough: Arc<AtomicBool>, heart: Beat) -> usize {
    let mut listed = 0;
    while !enough.load(Ordering::Relaxed) {
        service.list_voxels(&map(), ListingRequest::default()).await.expect("a listing");
        listed += 1;
        heart.beat();
    }
    listed
}

/// Puts scans in where columns were deleted, and elsewhere: how long each took, ascending.
async fn insertions(
    service: MapService,
    floors: usize,
    enough: Arc<AtomicBool>,
    heart: Beat,
) -> Vec<Duration> {
    let mut times = Vec::new();
    while !enough.load(Ordering::Relaxed) {
        let rows = SCAN_POINTS / FLOOR_SIDE;
        let at = |i: usize| {
            let row = (times.len() * rows + i / FLOOR_SIDE) % (floors * FLOOR_SIDE);
            point(row % FLOOR_SIDE, i % FLOOR_SIDE, row / FLOOR_SIDE)
        };
        let points: Vec<Point> = (0..SCAN_POINTS).map(at).collect();
        let start = Instant::now();
        insert(&service, points).await;
        times.push(start.elapsed());
        heart.beat();
    }
    times.sort_unstable();
    times
}

async fn insert(service: &MapService, points: Vec<Point>) {
    let scan = ScanRequest {
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("r1").unwrap(), points.into())
    };
    assert!(service.insert_scan(&map(), scan).await.expect("an insertion").accepted);
}

/// Deletes some columns of a floor each second, and puts them back, so that the map stays as large as it was; how often
/// that removed something.
async fn deletions(service: MapService, size: &Size, enough: Arc<AtomicBool>, heart: Beat) -> usize {
    let (mut random, mut removed) = (ChaCha8Rng::seed_from_u64(2), 0);
    let (least, most) = size.columns;
    let mut every_second = tokio::time::interval(Duration::from_secs(1));
    while !enough.load(Ordering::Relaxed) {
        every_second.tick().await;
        let columns = random.random_range(least..most) / least * least;
        let (first, floor) =
            (random.random_range(0..=FLOOR_SIDE - columns), random.random_range(0..size.floors));
        let meters = |voxels: usize| voxels as f64 * RESOLUTION_M;
        let low = [meters(first), 0.0, meters(floor * FLOOR_HEIGHT)];
        let high = [meters(first + columns), meters(FLOOR_SIDE), meters(floor * FLOOR_HEIGHT + 1)];
        let answer = delete(&service, Region::cuboid(low, high).unwrap()).await;
        removed += usize::from(answer > 0);
        heart.beat();
        for first in (first..first + columns).step_by(least) {
            let at = |i: usize| point(first + i % least, i / least, floor);
            insert(&service, (0..least * FLOOR_SIDE).map(at).collect()).await;
            heart.beat();
        }
    }
    removed
}

async fn delete(service: &MapService, region: Region) -> usize {
    let deletion = Deletion { target: DeletionTarget::Region(region), level: 0, request_id: None };
    service.delete_voxels(&map(), deletion).await.expect("a deletion").removed
}

fn part(times: &[Duration], part: f64) -> Duration {
    times[((times.len() as f64 * part).ceil() as usize).clamp(1, times.len()) - 1]
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn queries_wait_for_neither_listings_nor_deletions() {
    let (size, data) = (Size::of_environment(), tempfile::tempdir().unwrap());
    let service = service(&size, &data).await;
    let watchdog = Watchdog::begin(std::process::id(), STILL_MAX);
    let enough = Arc::new(AtomicBool::new(false));
    let (told, heart) = (|| Arc::clone(&enough), || watchdog.heart());
    let asking = tokio::spawn(queries(service.clone(), size.floors, told(), heart()));
    let listing = tokio::spawn(listings(service.clone(), told(), heart()));
    let inserting = tokio::spawn(insertions(service.clone(), size.floors, told(), heart()));
    let timer = async {
        tokio::time::sleep(size.duration).await;
        enough.store(true, Ordering::Relaxed);
    };
    let (removed, ()) = tokio::join!(deletions(service.clone(), &size, told(), heart()), timer);
    let (times, listed, inserted) = (asking.await.unwrap(), listing.await.unwrap(), inserting.await.unwrap());
    let [p50, p99, worst] = [0.5, 0.99, 1.0].map(|of| part(&times, of));
    println!(
        "{} queries p50 {p50:.1?} p99 {p99:.1?} max {worst:.1?}; {listed} listings, {removed} deletions; {} insertions \
         p50 {:.1?} max {:.1?}",
        times.len(),
        inserted.len(),
        part(&inserted, 0.5),
        part(&inserted, 1.0)
    );
    assert!(worst <= QUERY_MAX, "a query took {worst:?}");
    assert!(listed > 0 && !inserted.is_empty() && removed > 0 && times.len() > 10, "something stood still");
    assert!(
        !size.is_long || p99 <= QUERY_P99_MAX,
        "queries take {p99:?} at p99, {QUERY_P99_MAX:?} is the bound"
    );

    all_of_it_is_deleted(&service, &size, &watchdog).await;
}

/// At once: it takes little memory, and queries do not wait for it.
async fn all_of_it_is_deleted(service: &MapService, size: &Size, watchdog: &Watchdog) {
    let enough = Arc::new(AtomicBool::new(false));
    let asking = tokio::spawn(queries(service.clone(), size.floors, Arc::clone(&enough), watchdog.heart()));
    let before = BYTES.load(Ordering::Relaxed);
    BYTES_MAX.store(before, Ordering::Relaxed);
    let start = Instant::now();
    let everything = Region::cuboid([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]).unwrap();
    let removed = delete(service, everything).await;
    let (took, peak) = (start.elapsed(), BYTES_MAX.load(Ordering::Relaxed) - before);
    enough.store(true, Ordering::Relaxed);
    let worst = part(&asking.await.unwrap(), 1.0);
    println!(
        "{removed} voxels deleted in {took:.2?}: {:.1} bytes a voxel, queries waited {worst:.1?} at most",
        peak as f64 / removed as f64
    );
    assert!(removed * 10 > size.floors * FLOOR_VOXELS * 9, "{removed} voxels were there");
    assert!(
        peak <= removed * DELETION_BYTES_PER_VOXEL_MAX,
        "{removed} voxels took {peak} bytes, {DELETION_BYTES_PER_VOXEL_MAX} a voxel is the bound"
    );
    let bound = if size.is_long { QUERY_MAX_BESIDE_DELETION } else { QUERY_MAX };
    assert!(worst <= bound, "a query beside the deletion took {worst:?}, {bound:?} is the bound");
}
