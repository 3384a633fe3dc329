//! A service with one map, as it is behind both protocols.

use std::cell::Cell;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, Request, StatusCode};
use http_body_util::{BodyExt, Limited};
use mrol::access::{Access, Gate};
use mrol::admission::{Admission, Lifecycle};
use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, MapSettings, RobotName};
use mrol::mapping::Guess;
use mrol::middleware::Middleware;
use mrol::service::{Limits, MapService, PointCloud, Reason, ScanAnswer, ScanRequest, ServiceSettings};
use mrol::store::OpeningProgress;
use mrol::telemetry::{Audit, Metrics, RequestRecorder};
use tempfile::TempDir;
use tokio::runtime::Runtime;
use tower::ServiceExt;

/// Bytes of a request, at most.
pub(super) const MESSAGE_BYTES_MAX: usize = 1 << 16;
/// Bytes of an answer, at most.
const ANSWER_BYTES_MAX: usize = 8 << 20;
/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(20);
/// What was measured of them is folded together once for so many.
const REQUESTS_AN_UPKEEP: u64 = 1000;
/// Changes of the map as it is at first.
const REVISIONS: u64 = 2;

/// A service whose one map, `a`, has two scans of the robot `r1`, and a protocol in front of it.
pub(super) struct Hosted {
    runtime: Runtime,
    service: MapService,
    metrics: Metrics,
    router: Router,
    asked: Cell<u64>,
    _data: TempDir,
}

/// What came back.
pub(super) struct Answer {
    pub(super) status: StatusCode,
    pub(super) headers: HeaderMap,
    pub(super) trailers: HeaderMap,
    pub(super) body: Bytes,
}

impl Hosted {
    pub(super) fn new(protocol: impl FnOnce(&Middleware) -> Router) -> Self {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let data = tempfile::tempdir().expect("a folder");
        let (metrics, audit) = (Metrics::new().expect("metrics"), Audit::default());
        let settings = ServiceSettings {
            observers: vec![Arc::new(metrics.clone()), Arc::new(audit.clone())],
            data_dir: Some(data.path().to_owned()),
            limits: limits(),
            query_threads: 1,
            mapping_threads: 1,
            alignment_threads: 1,
            localization_threads: 1,
            ..ServiceSettings::default()
        };
        let service = MapService::open(settings, &OpeningProgress::default()).expect("a service");
        let gate = Gate::new(Access::open(), service.clone());
        let admission = Admission::new(&Limits::default(), Lifecycle::default());
        let recorder = RequestRecorder::new(metrics.clone(), audit);
        let router = protocol(&Middleware::new(gate, admission, recorder));
        let hosted = Self { runtime, service, metrics, router, asked: Cell::new(0), _data: data };
        hosted.runtime.block_on(hosted.make_map());
        hosted
    }

    /// The answer to one request.
    pub(super) fn ask(&self, request: Request<Body>) -> Answer {
        if self.asked.replace(self.asked.get() + 1).is_multiple_of(REQUESTS_AN_UPKEEP) {
            self.metrics.upkeep();
        }
        self.runtime.block_on(async {
            let answered = tokio::time::timeout(PATIENCE, async {
                let answer = self.router.clone().oneshot(request).await.expect("an answer");
                let (parts, body) = answer.into_parts();
                let body =
                    Limited::new(body, ANSWER_BYTES_MAX).collect().await.expect("a body within bounds");
                let trailers = body.trailers().cloned().unwrap_or_default();
                Answer { status: parts.status, headers: parts.headers, trailers, body: body.to_bytes() }
            });
            answered.await.expect("an answer in time")
        })
    }

    /// Changes of the map; none where it is gone.
    pub(super) fn revision(&self) -> Option<u64> {
        let state = self.runtime.block_on(self.service.trajectory(&name(), Default::default()));
        state.ok().map(|answer| answer.version.revision)
    }

    /// Makes the maps what they were at first, where a change was made.
    pub(super) fn reset(&self, maps_changed: bool) {
        if maps_changed || self.revision() != Some(REVISIONS) {
            self.runtime.block_on(async {
                for map in self.service.list_maps().await.expect("a list") {
                    self.service.delete_map(&map.name).await.expect("a map that is gone");
                }
                self.make_map().await;
            });
        }
    }

    async fn make_map(&self) {
        self.service.create_map(name(), MapSettings::new(0.1, 4)).await.expect("a map");
        for scan_id in 1..=REVISIONS {
            assert!(self.insert(scan_id).await.accepted);
        }
    }

    /// Inserts a scan, again where the machine is too busy for the short time that insertions have here.
    async fn insert(&self, scan_id: u64) -> ScanAnswer {
        loop {
            match self.service.insert_scan(&name(), scan(scan_id)).await {
                Err(error) if error.reason == Reason::TimeLimit => {}
                answer => return answer.expect("an answer"),
            }
        }
    }
}

/// So small that reaching them costs little.
fn limits() -> Limits {
    Limits {
        points_per_request_max: 2000,
        keys_per_request_max: 2000,
        maps_max: 3,
        voxels_per_map_max: 20_000,
        listed_voxels_max: 10_000,
        block_bytes_max: 256 << 10,
        block_cells_max: 1 << 20,
        map_file_bytes_max: MESSAGE_BYTES_MAX,
        min_revision_wait_max_s: 0.001,
        alignment_time_max_s: 0.2,
        insertion_time_max_s: 0.2,
        undo_time_max_s: 0.2,
        localization_time_max_s: 0.02,
        recovery_search_time_max_s: 0.02,
        recovery_search_interval_s: 0.02,
        localization_candidates_max: 4,
        localization_grid_bytes_max: 4 << 20,
        ..Limits::default()
    }
}

fn name() -> MapName {
    MapName::new("a").expect("a name")
}

/// Two walls and a floor of 2 m, seen from their corner.
fn scan(scan_id: u64) -> ScanRequest {
    let at = |i: usize| (i as f32 + 0.5) * 0.08;
    let wall = |axis: usize| {
        (0..625).map(move |i| {
            let mut point = [at(i % 25), at(i / 25), 0.02];
            point.rotate_right(axis);
            Point::from(point)
        })
    };
    let robot = RobotName::new("r1").expect("a name");
    let points = PointCloud::from((0..3).flat_map(wall).collect::<Vec<_>>());
    ScanRequest {
        scan_id: Some(scan_id),
        timestamp_ns: Some(scan_id as i64 * 100_000_000),
        guess: Guess::Pose(Pose::translation(0.0, 0.0, scan_id as f64 * 0.01)),
        at_guess: true,
        force: true,
        ..ScanRequest::new(robot, points)
    }
}
