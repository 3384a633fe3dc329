//! Those who write to the map of a site and read it, whatever happens to its nodes.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use mrol::client::{Client, ClientError};
use mrol::geometry::{Point, Pose};
use mrol::map::{Lookup, MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::{PointQuery, ScanRequest};
use tokio::task::JoinHandle;

use crate::site::{NODES, Site, WITHIN};

pub(crate) const WRITERS: usize = 4;

/// Pause before a scan that was not acknowledged is sent again.
const PAUSE: Duration = Duration::from_millis(20);

/// Those who write and read.
pub(crate) struct Load {
    is_over: Arc<AtomicBool>,
    tasks: Vec<JoinHandle<()>>,
    /// When each writer's scans were acknowledged.
    acknowledged: Vec<Arc<Mutex<Vec<Instant>>>>,
    /// What a writer was refused with last.
    refused: Arc<Mutex<String>>,
    readers: Vec<Arc<Reads>>,
}

/// What a reader of one node has seen.
#[derive(Default)]
pub(crate) struct Reads {
    /// How long answers took.
    took: Mutex<Vec<Duration>>,
    /// What was said to questions that failed while the node was said to be up.
    failed: Mutex<Vec<String>>,
    is_up: AtomicBool,
}

impl Load {
    /// Begins: each writer has a list of all nodes, another one first, each reader one node.
    pub(crate) fn begin(site: &Site, map: &MapName) -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let mut this = Self {
            is_over,
            tasks: Vec::new(),
            acknowledged: Vec::new(),
            refused: Arc::default(),
            readers: Vec::new(),
        };
        for writer in 0..WRITERS {
            let client = site.client(&site.all_grpc(writer % NODES));
            let acknowledged = Arc::<Mutex<Vec<Instant>>>::default();
            this.acknowledged.push(Arc::clone(&acknowledged));
            let refused = Arc::clone(&this.refused);
            let task = write(client, map.clone(), writer, Arc::clone(&this.is_over), acknowledged, refused);
            this.tasks.push(site.runtime().spawn(task));
        }
        for node in 0..NODES {
            let reads = Arc::new(Reads { is_up: AtomicBool::new(true), ..Reads::default() });
            this.readers.push(Arc::clone(&reads));
            let task = read(site.grpc(node), map.clone(), Arc::clone(&this.is_over), reads);
            this.tasks.push(site.runtime().spawn(task));
        }
        this
    }

    /// Says whether questions to a node may fail from now on: they may while it is killed, stopped or starting.
    pub(crate) fn set_up(&self, node: usize, is_up: bool) {
        self.readers[node].is_up.store(is_up, Ordering::Release);
    }

    /// Waits until every writer has had so many scans more acknowledged.
    #[track_caller]
    pub(crate) fn wait_for(&self, scans: usize) {
        let counts = || self.acknowledged.iter().map(|it| it.lock().unwrap().len());
        let wanted: Vec<_> = counts().map(|count| count + scans).collect();
        let begun = Instant::now();
        while counts().zip(&wanted).any(|(count, wanted)| count < *wanted) {
            assert!(
                begun.elapsed() < WITHIN,
                "writers are not acknowledged: {wanted:?}, {:?}",
                counts().collect::<Vec<_>>()
            );
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Waits until a writer is refused with such words.
    #[track_caller]
    pub(crate) fn wait_until_refused(&self, words: &str) {
        self.refused.lock().unwrap().clear();
        let begun = Instant::now();
        while !self.refused.lock().unwrap().contains(words) {
            let last = self.refused.lock().unwrap().clone();
            assert!(begun.elapsed() < WITHIN, "nobody was refused with {words:?}, but: {last}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// The longest time without an acknowledgment of any one writer, after `since`.
    pub(crate) fn longest_gap(&self, since: Instant) -> Duration {
        let of_writer = |times: &Arc<Mutex<Vec<Instant>>>| {
            let times = times.lock().unwrap();
            let after = times.partition_point(|time| *time <= since);
            let times = &times[after.saturating_sub(1)..];
            times.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or_default()
        };
        self.acknowledged.iter().map(of_writer).max().unwrap_or_default()
    }

    /// Ends it: how many scans were acknowledged, and what the readers saw.
    pub(crate) fn end(self, site: &Site) -> (usize, Vec<Arc<Reads>>) {
        self.is_over.store(true, Ordering::Release);
        for task in self.tasks {
            site.runtime().block_on(async { tokio::time::timeout(WITHIN, task).await }).unwrap().unwrap();
        }
        (self.acknowledged.iter().map(|it| it.lock().unwrap().len()).sum(), self.readers)
    }
}

impl Reads {
    /// What was said to questions that failed while the node was said to be up, how many were answered, and the 99th
    /// percentile of how long those took.
    pub(crate) fn summary(&self) -> (Vec<String>, usize, Duration) {
        let mut took = self.took.lock().unwrap().clone();
        took.sort();
        let slow = took.get(took.len() * 99 / 100).copied().unwrap_or_default();
        (self.failed.lock().unwrap().clone(), took.len(), slow)
    }
}

/// Scans of one voxel each, under their numbers, again and again until they are acknowledged.
async fn write(
    client: Client,
    map: MapName,
    writer: usize,
    is_over: Arc<AtomicBool>,
    acknowledged: Arc<Mutex<Vec<Instant>>>,
    refused: Arc<Mutex<String>>,
) {
    let robot = RobotName::new(&format!("writer-{writer}")).unwrap();
    let mut number = 0;
    while !is_over.load(Ordering::Acquire) {
        let point = Point::new(0.25 + number as f32 * 0.5, 0.25 + writer as f32 * 0.5, 0.25);
        let scan = ScanRequest {
            scan_id: Some(number),
            guess: Guess::Pose(Pose::identity()),
            at_guess: true,
            ..ScanRequest::new(robot.clone(), vec![point].into())
        };
        // What was begun is sent until it is acknowledged: at the end all is known.
        while let Err(error) = client.insert_scan(&map, scan.clone()).await {
            let reason = error.reason().unwrap_or("lost").to_owned();
            let may_come_again = [
                "lost",
                "no_quorum",
                "not_leader",
                "outcome_unknown",
                "draining",
                "revision_not_reached",
                "disk_full",
                "map_read_only",
                "overloaded",
            ];
            assert!(may_come_again.contains(&reason.as_str()), "writer {writer}: {error}");
            *refused.lock().unwrap() = error.to_string();
            tokio::time::sleep(PAUSE).await;
        }
        acknowledged.lock().unwrap().push(Instant::now());
        number += 1;
    }
}

/// Asks one node about a point, again and again. What it answers never goes back.
async fn read(grpc: String, map: MapName, is_over: Arc<AtomicBool>, reads: Arc<Reads>) {
    let began = Instant::now();
    let mut revision = 0;
    let mut client = None;
    while !is_over.load(Ordering::Acquire) {
        tokio::time::sleep(Duration::from_millis(5)).await;
        // What was begun while it was killed may fail after it is said to be up.
        let was_up = reads.is_up.load(Ordering::Acquire);
        let begun = Instant::now();
        match ask(&mut client, &grpc, &map).await {
            Ok(answered) => {
                assert!(answered >= revision, "a node went back");
                revision = answered;
                reads.took.lock().unwrap().push(begun.elapsed());
            }
            // It may have been killed while it was asked.
            Err(error) if was_up && reads.is_up.load(Ordering::Acquire) => {
                let said = format!("at {:.3} s: {error}", began.elapsed().as_secs_f64());
                reads.failed.lock().unwrap().push(said);
            }
            Err(_) => {}
        }
        if !reads.is_up.load(Ordering::Acquire) {
            // It may begin anew from an older copy.
            (client, revision) = (None, 0);
        }
    }
}

/// Asks a node about a point: the revision that its answer names.
async fn ask(client: &mut Option<Client>, grpc: &str, map: &MapName) -> Result<u64, ClientError> {
    let client = match client {
        Some(client) => client,
        None => client.insert(Client::connect(grpc).await?),
    };
    let query = PointQuery {
        points: vec![Point::new(0.25, 0.25, 0.25)].into(),
        map_from_points: None,
        level: 0,
        lookup: Lookup::Exact,
        min_revision: None,
        map_uuid: None,
        keep_out: false,
    };
    Ok(client.query_points(map, query).await?.version.revision)
}
