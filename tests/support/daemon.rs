//! A server of its own for each test: in this process, on free ports, with its maps in a folder of its own.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mrol::config::Config;
use mrol::server::{Server, ServerError};
use mrol::service::Gauges;
use mrol::wire::pb;
use pb::mapping_client::MappingClient;
use pb::maps_client::MapsClient;
use pb::occupancy_client::OccupancyClient;
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use tonic::transport::Channel;

use super::description::as_described;

/// How long anything may take before a test gives up.
pub const PATIENCE: Duration = Duration::from_secs(20);

/// Waits until it happened.
pub async fn wait_until<F: Future<Output = bool>>(mut happened: impl FnMut() -> F) {
    let start = Instant::now();
    while !happened().await {
        assert!(start.elapsed() < PATIENCE, "it never happened");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

/// A running server.
pub struct Daemon {
    pub http: SocketAddr,
    pub grpc: SocketAddr,
    pub admin: Option<SocketAddr>,
    pub data: TempDir,
    stop: oneshot::Sender<()>,
    running: JoinHandle<Result<(), ServerError>>,
}

impl Daemon {
    /// With the default settings.
    pub async fn start() -> Self {
        Self::start_with(|_| {}).await
    }

    /// With settings changed by `change`.
    pub async fn start_with(change: impl FnOnce(&mut Config)) -> Self {
        Self::start_in(tempfile::tempdir().expect("a folder"), change).await
    }

    /// With the maps in `data`.
    pub async fn start_in(data: TempDir, change: impl FnOnce(&mut Config)) -> Self {
        let server = Server::bind(config(&data, change)).await.expect("a server");
        Self::serve(server, data).await
    }

    /// With other gauges of disk and memory than the system's.
    pub async fn start_with_gauges(gauges: Arc<dyn Gauges>, change: impl FnOnce(&mut Config)) -> Self {
        Self::start_with_gauges_in(tempfile::tempdir().expect("a folder"), gauges, change).await
    }

    /// The same with the maps in `data`.
    pub async fn start_with_gauges_in(
        data: TempDir,
        gauges: Arc<dyn Gauges>,
        change: impl FnOnce(&mut Config),
    ) -> Self {
        let server = Server::bind_with(config(&data, change), gauges).await.expect("a server");
        Self::serve(server, data).await
    }

    /// Serves; where there are maps, once they are open.
    async fn serve(server: Server, data: TempDir) -> Self {
        let (http, grpc, admin) = (server.http_address(), server.grpc_address(), server.admin_address());
        let maps = std::fs::read_dir(data.path().join("maps"));
        let has_maps = maps.is_ok_and(|mut maps| maps.next().is_some()) && !server.is_secured();
        let (stop, stopped) = oneshot::channel();
        let running = tokio::spawn(server.run(async move { drop(stopped.await) }));
        let daemon = Self { http, grpc, admin, data, stop, running };
        if has_maps {
            wait_until(async || daemon.get("/readyz").await.status() == StatusCode::OK).await;
        }
        daemon
    }

    /// Begins to go down.
    pub fn tell_to_stop(self) -> Stopping {
        self.stop.send(()).expect("a server that runs");
        Stopping { running: self.running, data: self.data }
    }

    /// Goes down; the folder of its maps.
    pub async fn stop(self) -> TempDir {
        self.tell_to_stop().stopped().await
    }

    pub async fn channel(&self) -> Channel {
        let endpoint = Channel::from_shared(format!("http://{}", self.grpc)).expect("an address");
        endpoint.connect().await.expect("a connection")
    }

    pub async fn occupancy(&self) -> OccupancyClient<Channel> {
        OccupancyClient::new(self.channel().await)
    }

    pub async fn mapping(&self) -> MappingClient<Channel> {
        MappingClient::new(self.channel().await).max_encoding_message_size(64 << 20)
    }

    pub async fn maps(&self) -> MapsClient<Channel> {
        MapsClient::new(self.channel().await)
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.http)
    }

    /// Makes a map of 0.1 m and four levels.
    pub async fn make_map(&self, name: &str) {
        let settings = json!({"resolution_m": 0.1, "levels": 4});
        let made = self.put(&format!("/v1/maps/{name}"), settings).await;
        assert_eq!(made.status(), StatusCode::CREATED);
    }

    /// Puts points into a map as they are.
    pub async fn put_in(&self, map: &str, points: &[[f32; 3]]) -> Value {
        let scan = json!({"robot": "setup", "points": points, "guess": identity_json(), "align": false});
        let put = self.post(&format!("/v1/maps/{map}/scans"), scan).await;
        assert_eq!(put.status(), StatusCode::OK);
        json_of(put).await
    }

    /// The level's voxels, sorted, and the revision: what a test compares to see whether a map changed.
    pub async fn contents(&self, map: &str) -> (u64, Vec<[i64; 3]>) {
        let listing = json_of(self.get(&format!("/v1/maps/{map}/voxels")).await).await;
        let mut voxels: Vec<[i64; 3]> =
            serde_json::from_value(listing["voxels"].clone()).expect("a list of indices");
        voxels.sort_unstable();
        (listing["revision"].as_u64().expect("a revision"), voxels)
    }

    pub async fn get(&self, path: &str) -> Response {
        let answer = client().get(self.url(path)).send().await.expect("an answer");
        as_described(Method::GET, path, answer).await
    }

    /// What `/metrics` says of `series`, a name with its labels; none before it is first recorded.
    pub async fn metric(&self, series: &str) -> Option<f64> {
        let metrics = self.get("/metrics").await.text().await.expect("text");
        let value = metrics.lines().find_map(|line| line.strip_prefix(series)?.strip_prefix(' '))?;
        Some(value.parse().expect("a number"))
    }

    pub async fn delete(&self, path: &str) -> Response {
        let answer = client().delete(self.url(path)).send().await.expect("an answer");
        as_described(Method::DELETE, path, answer).await
    }

    pub async fn put(&self, path: &str, body: Value) -> Response {
        let answer = client().put(self.url(path)).json(&body).send().await.expect("an answer");
        as_described(Method::PUT, path, answer).await
    }

    pub async fn post(&self, path: &str, body: Value) -> Response {
        let answer = client().post(self.url(path)).json(&body).send().await.expect("an answer");
        as_described(Method::POST, path, answer).await
    }

    pub async fn post_bytes(&self, path: &str, body: Vec<u8>) -> Response {
        let post = client().post(self.url(path)).header("content-type", "application/octet-stream");
        let answer = post.body(body).send().await.expect("an answer");
        as_described(Method::POST, path, answer).await
    }
}

fn config(data: &TempDir, change: impl FnOnce(&mut Config)) -> Config {
    let mut config = Config { data_dir: data.path().to_owned(), ..Config::default() };
    config.http.listen.set_port(0);
    config.grpc.listen.set_port(0);
    // What a test has just done is to be seen.
    config.limits.scrape_kept_s = 0.0;
    change(&mut config);
    config
}

/// A server that was told to go down.
pub struct Stopping {
    running: JoinHandle<Result<(), ServerError>>,
    data: TempDir,
}

impl Stopping {
    /// Waits until it is down; the folder of its maps.
    pub async fn stopped(self) -> TempDir {
        let ended = tokio::time::timeout(PATIENCE, self.running).await.expect("a server that goes down");
        ended.expect("no panic").expect("a clean end");
        self.data
    }
}

pub fn client() -> reqwest::Client {
    reqwest::Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

pub async fn json_of(response: Response) -> Value {
    response.json().await.expect("json")
}

/// The identity as HTTP writes it.
pub fn identity_json() -> Value {
    pose_json([0.0; 3])
}

/// A pose without rotation as HTTP writes it.
pub fn pose_json(translation_m: [f64; 3]) -> Value {
    json!({"translation_m": translation_m, "rotation_xyzw": [0.0, 0.0, 0.0, 1.0]})
}

/// A pose without rotation as gRPC writes it.
pub fn pose_pb(translation_m: [f64; 3]) -> pb::Pose {
    pb::Pose {
        translation_m: Some(translation_m.into()),
        rotation: Some(pb::Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    }
}

/// Points as their bytes.
pub fn bytes_of(points: &[[f32; 3]]) -> Vec<u8> {
    points.iter().flatten().flat_map(|c| c.to_le_bytes()).collect()
}

/// Points as gRPC's bytes.
pub fn points_pb(points: &[[f32; 3]]) -> Option<pb::Points> {
    Some(pb::Points { xyz_f32le: bytes_of(points).into(), xyz: Vec::new() })
}

/// A corner of three walls of 2 m, half a meter from the sensor, a point each 4 cm: nothing of a pose in it is open.
pub fn corner() -> Vec<[f32; 3]> {
    let wall = |normal: usize| {
        (0..2500).map(move |i| {
            let mut point = [(i % 50) as f32 * 0.04 - 0.5, (i / 50) as f32 * 0.04 - 0.5, 0.02 - 0.5];
            point.rotate_right(normal);
            point
        })
    };
    (0..3).flat_map(wall).collect()
}

/// A scan that goes in where it says.
pub fn scan_pb(map: &str, robot: &str, points: &[[f32; 3]]) -> pb::InsertScanRequest {
    pb::InsertScanRequest {
        map: map.into(),
        scan: Some(pb::Scan { robot: robot.into(), points: points_pb(points), ..Default::default() }),
        guess: guess_pb([0.0; 3]),
        at_guess: true,
        ..Default::default()
    }
}

/// A guess without rotation.
pub fn guess_pb(translation_m: [f64; 3]) -> Option<pb::Guess> {
    let kind = Some(pb::guess::Kind::MapFromSensor(pose_pb(translation_m)));
    Some(pb::Guess { kind, ..Default::default() })
}

/// A question about points.
pub fn query_pb(map: &str, points: &[[f32; 3]]) -> pb::QueryPointsRequest {
    pb::QueryPointsRequest { map: map.into(), points: points_pb(points), ..Default::default() }
}

/// Centers of `count` voxels of 0.1 m in a row along x.
pub fn row(count: usize) -> Vec<[f32; 3]> {
    (0..count).map(|i| [i as f32 * 0.1 + 0.05, 0.05, 0.05]).collect()
}

/// The bits of an answer.
pub fn bits_of(bitmap: &[u8], points: usize) -> Vec<bool> {
    (0..points).map(|i| bitmap[i / 8] >> (i % 8) & 1 == 1).collect()
}
