//! Honest clients: a robot and planners of both protocols, one request after another.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mrol::wire::pb::mapping_client::MappingClient;
use mrol::wire::pb::occupancy_client::OccupancyClient;
use serde_json::json;
use tonic::transport::{Channel, Endpoint};

use crate::support::daemon::{PATIENCE, bytes_of, client, query_pb, row, scan_pb};

/// So many that they are answered by a pool.
const POINTS: usize = 3000;
/// Between two rounds, and before a request is tried again.
const PAUSE: Duration = Duration::from_millis(10);
const BEFORE_ANOTHER_TRY: Duration = Duration::from_millis(50);

/// A thread of its own with all of them.
pub(crate) struct Honest {
    enough: Arc<AtomicBool>,
    answers: Arc<AtomicUsize>,
    thread: Option<JoinHandle<usize>>,
}

/// How they were served: each request, in the end.
pub(crate) struct Served {
    pub served: usize,
    pub tried_again: usize,
}

struct Clients {
    robot: MappingClient<Channel>,
    planner: OccupancyClient<Channel>,
    http: reqwest::Client,
    url: String,
    scan_id: u64,
}

impl Honest {
    /// Makes a map and begins to ask.
    pub(crate) async fn begin(http: &str, grpc: &str) -> Self {
        let settings = json!({"resolution_m": 0.1, "levels": 4});
        let made = client().put(format!("{http}/v1/maps/hall")).json(&settings).send().await.unwrap();
        assert_eq!(made.status(), 201);
        let (enough, answers) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        let (told, counted) = (Arc::clone(&enough), Arc::clone(&answers));
        let (http, grpc) = (http.to_owned(), grpc.to_owned());
        let thread = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(async {
                let mut clients = Clients::of(http, grpc);
                let mut tried_again = 0;
                while !told.load(Ordering::Relaxed) {
                    tried_again += clients.round(&counted).await;
                    tokio::time::sleep(PAUSE).await;
                }
                tried_again
            })
        });
        Self { enough, answers, thread: Some(thread) }
    }

    /// Waits until so many more requests were answered.
    pub(crate) async fn wait_for_answers(&mut self, more: usize) {
        let (start, least) = (Instant::now(), self.answers.load(Ordering::Relaxed) + more);
        while self.answers.load(Ordering::Relaxed) < least {
            if self.thread.as_ref().is_some_and(JoinHandle::is_finished) {
                self.join();
            }
            assert!(start.elapsed() < 3 * PATIENCE, "honest clients are not served");
            tokio::time::sleep(PAUSE).await;
        }
    }

    pub(crate) fn end(mut self) -> Served {
        self.enough.store(true, Ordering::Relaxed);
        let tried_again = self.join();
        Served { served: self.answers.load(Ordering::Relaxed), tried_again }
    }

    fn join(&mut self) -> usize {
        self.thread.take().unwrap().join().expect("honest clients are served")
    }
}

impl Clients {
    fn of(http: String, grpc: String) -> Self {
        let channel = Endpoint::from_shared(grpc).unwrap().connect_lazy();
        Self {
            robot: MappingClient::new(channel.clone()),
            planner: OccupancyClient::new(channel),
            http: client(),
            url: format!("{http}/v1/maps/hall/occupancy"),
            scan_id: 0,
        }
    }

    /// A scan and a question in each protocol; how often one had to be asked again.
    async fn round(&mut self, answers: &AtomicUsize) -> usize {
        self.scan_id += 1;
        let mut scan = scan_pb("hall", "r1", &row(100));
        scan.scan.as_mut().unwrap().scan_id = Some(self.scan_id);
        let mut again = 0;
        again += until_served(async || self.robot.clone().insert_scan(scan.clone()).await).await;
        let question = query_pb("hall", &row(POINTS));
        again += until_served(async || self.planner.clone().query_points(question.clone()).await).await;
        let points = bytes_of(&row(POINTS));
        again += until_served(async || {
            let post = self.http.post(&self.url).header("content-type", "application/octet-stream");
            post.body(points.clone()).send().await?.error_for_status()
        })
        .await;
        answers.fetch_add(3, Ordering::Relaxed);
        again
    }
}

/// Asks until there is an answer: a server that sheds says that this is what to do. How often that was.
async fn until_served<T, E: std::fmt::Debug>(ask: impl AsyncFn() -> Result<T, E>) -> usize {
    let start = Instant::now();
    let mut again = 0;
    while let Err(refusal) = ask().await {
        assert!(start.elapsed() < PATIENCE, "an honest client is not served: {refusal:?}");
        again += 1;
        tokio::time::sleep(BEFORE_ANOTHER_TRY).await;
    }
    again
}
