//! A planner that asks about the map, batch after batch, while it grows.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use mrol::console::CliError;
use mrol::console::Serving;
use mrol_client::Client;
use mrol_map::geometry::Point;
use mrol_map::map::{Lookup, MapName};
use mrol_service::{PointCloud, PointQuery};

/// Points of one batch.
pub(super) const BATCH_POINTS: usize = 100_000;
/// Number of different batches, which are queried in turn.
const BATCHES: usize = 8;
/// The building of the simulated scene, meters: candidates lie anywhere in it.
const BUILDING_M: [f32; 3] = [14.0, 9.0, 2.7];

pub(super) struct Planner {
    tally: Arc<Tally>,
    enough: CancellationToken,
    task: JoinHandle<Result<(), CliError>>,
    start: Instant,
}

/// Tally of the planner's answers so far.
#[derive(Debug, Default)]
pub(super) struct Tally {
    points: AtomicU64,
    occupied: AtomicU64,
}

/// Answers of a planner over some time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Told {
    pub(super) points: u64,
    pub(super) occupied: u64,
    pub(super) time: Duration,
}

impl Told {
    pub(super) fn points_per_s(&self) -> f64 {
        self.points as f64 / self.time.as_secs_f64()
    }

    pub(super) fn share_occupied(&self) -> f64 {
        self.occupied as f64 / self.points.max(1) as f64
    }
}

impl Tally {
    /// The number of points answered, and how many of them were occupied.
    pub(super) fn read(&self) -> (u64, u64) {
        (self.points.load(Ordering::Relaxed), self.occupied.load(Ordering::Relaxed))
    }

    fn add(&self, points: usize, occupied: usize) {
        self.points.fetch_add(points as u64, Ordering::Relaxed);
        self.occupied.fetch_add(occupied as u64, Ordering::Relaxed);
    }
}

impl Planner {
    /// Starts the queries, on a connection of its own.
    pub(super) async fn start(serving: &Serving, map: &MapName, seed: u64) -> Result<Self, CliError> {
        let client = Client::connect(&serving.grpc.to_string()).await?;
        let (tally, enough) = (Arc::<Tally>::default(), CancellationToken::new());
        let task =
            tokio::spawn(ask(client, map.clone(), candidates(seed), Arc::clone(&tally), enough.clone()));
        Ok(Self { tally, enough, task, start: Instant::now() })
    }

    pub(super) fn tally(&self) -> Arc<Tally> {
        Arc::clone(&self.tally)
    }

    /// Waits for the answers in flight; returns the tally.
    pub(super) async fn stop(self) -> Result<Told, CliError> {
        self.enough.cancel();
        self.task.await.map_err(CliError::failed)??;
        let (points, occupied) = self.tally.read();
        Ok(Told { points, occupied, time: self.start.elapsed() })
    }
}

/// Queries on one stream until it is told to stop.
async fn ask(
    client: Client,
    map: MapName,
    batches: Vec<PointCloud>,
    tally: Arc<Tally>,
    enough: CancellationToken,
) -> Result<(), CliError> {
    let queries = batches.into_iter().cycle().take_while(move |_| !enough.is_cancelled()).map(query);
    let mut answers = client.query_stream(&map, tokio_stream::iter(queries)).await?;
    while let Some(answer) = answers.next().await {
        let answer = answer?;
        tally.add(answer.points, answer.points_occupied);
    }
    Ok(())
}

fn query(points: PointCloud) -> PointQuery {
    PointQuery {
        points,
        map_from_points: None,
        level: 0,
        lookup: Lookup::Exact,
        min_revision: None,
        map_uuid: None,
        keep_out: false,
    }
}

/// Batches of points anywhere in the building.
fn candidates(seed: u64) -> Vec<PointCloud> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut point = || Point::from(BUILDING_M.map(|side_m| rng.random_range(0.0..side_m)));
    (0..BATCHES).map(|_| (0..BATCH_POINTS).map(|_| point()).collect::<Vec<_>>().into()).collect()
}
