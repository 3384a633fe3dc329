//! The recorder of metrics.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use metrics::{SharedString, counter, gauge, histogram, with_local_recorder};
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusRecorder};

use parking_lot::Mutex;

use crate::build_info;
use crate::telemetry::families::{
    ALIGN_SECONDS, BODY_BYTES, BUILD_INFO, CERTIFICATE_EXPIRES, CONNECTIONS_ACCEPTED, CONNECTIONS_OPEN,
    CONNECTIONS_REFUSED, DISK_FREE_BYTES, FILE_RELOAD_OK, HANDSHAKES_FAILED, KEY_REQUESTS,
    MEMORY_RESIDENT_BYTES, REQUEST_SECONDS, REQUESTS, REQUESTS_DENIED, REQUESTS_IN_FLIGHT, ROBOT_SCANS,
    SCAN_OVERLAP, STREAMS_OPEN, WATCHES_OPEN, WRITES_REFUSED,
};
use crate::telemetry::log::TelemetryError;
use crate::telemetry::map_counters::{Family, MapCounters};
use crate::telemetry::node::{NodeReading, write_node};
use crate::telemetry::{exposition, families};
use mrol_map::map::{MapName, RobotName};
use mrol_service::{
    End, Ended, JudgedScan, LaneUse, MapInfo, MapsAwake, Observer, Outcome, Readings, Reason, SharedMap,
    Shortage, UnavailableMap,
};

/// Upper bounds of the latency histogram, seconds: a small query takes 0.1 ms, an alignment up to seconds, and a change
/// beside a disk that hangs as long as that.
const SECONDS_BUCKETS: [f64; 17] = [
    0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0, 30.0,
    60.0,
];

/// Upper bounds of the histogram of overlaps: a robot that fits lies between 0.6 and 1, one that is lost below 0.3.
const OVERLAP_BUCKETS: [f64; 10] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];

/// Names of keys with a series of their own: those that came later are counted together. A file of keys may change as
/// often as one likes, and what was counted once stays.
pub(super) const KEY_SERIES_MAX: usize = 1000;
/// The label of those; no key has such a name.
const OTHER_KEYS: &str = "(others)";

/// The robot of all scans that came after those of [`Metrics::ROBOTS_MAX`] others.
const OTHER_ROBOTS: &str = "other";

/// How much of what admission limits is in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InUse {
    /// Requests in work.
    pub requests: usize,
    /// Requests whose bodies are arriving.
    pub arriving: usize,
    /// Streams.
    pub streams: usize,
    /// Watches of maps.
    pub watches: usize,
    /// Bytes of bodies and answers.
    pub bytes: usize,
}

/// What is known of the service at a scrape, for a caller who may name these maps.
#[derive(Debug, Default)]
pub struct ServiceReading {
    /// Its lanes.
    pub lanes: Vec<LaneUse>,
    /// The maps whose counters are told.
    pub names: Vec<MapName>,
    /// Those that are open.
    pub maps: Vec<MapInfo>,
    /// How many are in memory.
    pub awake: MapsAwake,
    /// Those that could not be opened.
    pub unavailable: Vec<UnavailableMap>,
    /// Those that nodes of a cluster share.
    pub shared: Vec<SharedMap>,
}

/// The metrics of one server. A clone is another handle on the same ones.
///
/// The recorder is the server's own and not the process's, so that several servers in one process (tests, a
/// demo) count apart.
#[derive(Debug, Clone)]
pub struct Metrics(Arc<Kept>);

#[derive(Debug)]
struct Kept {
    recorder: PrometheusRecorder,
    maps: MapCounters,
    /// Names of keys that have a series.
    keys: Mutex<BTreeSet<String>>,
    /// Robots whose scans are counted by name.
    robots: Mutex<BTreeSet<RobotName>>,
    /// What a node of a cluster knew of it a moment ago; none of a server by itself.
    node: Mutex<Option<NodeReading>>,
}

impl Metrics {
    /// Robots whose scans are counted by name; the scans of all others are counted together. Names come from callers,
    /// and a series is kept for as long as the server runs.
    pub const ROBOTS_MAX: usize = 100;

    /// Metrics that are all zero.
    ///
    /// # Errors
    /// When the recorder refuses the buckets.
    pub fn new() -> Result<Self, TelemetryError> {
        let latency = Matcher::Full(REQUEST_SECONDS.to_owned());
        let overlap = Matcher::Full(SCAN_OVERLAP.to_owned());
        let alignment = Matcher::Full(ALIGN_SECONDS.to_owned());
        let builder = PrometheusBuilder::new()
            .set_buckets_for_metric(latency, &SECONDS_BUCKETS)?
            .set_buckets_for_metric(overlap, &OVERLAP_BUCKETS)?
            .set_buckets_for_metric(alignment, &SECONDS_BUCKETS)?;
        let recorder = builder.build_recorder();
        let kept = Kept {
            recorder,
            maps: MapCounters::default(),
            keys: Mutex::default(),
            robots: Mutex::default(),
            node: Mutex::default(),
        };
        let metrics = Self(Arc::new(kept));
        metrics.record(families::describe);
        metrics.record(|| {
            gauge!(BUILD_INFO, "version" => build_info::VERSION, "commit" => build_info::COMMIT, "features" => build_info::FEATURES)
                .set(1.0);
        });
        Ok(metrics)
    }

    /// Counts a request, or a message of a stream, that was answered with `code` after `elapsed`.
    pub fn request(
        &self,
        protocol: &'static str,
        operation: &'static str,
        code: impl Into<SharedString>,
        elapsed: Duration,
    ) {
        self.record(|| {
            counter!(REQUESTS, "protocol" => protocol, "operation" => operation, "code" => code.into())
                .increment(1);
            histogram!(REQUEST_SECONDS, "protocol" => protocol, "operation" => operation).record(elapsed);
        });
    }

    /// Counts a call or request that was let in with a key.
    pub fn key_used(&self, protocol: &'static str, key: &str) {
        let key = self.label_of_key(key);
        self.record(|| counter!(KEY_REQUESTS, "protocol" => protocol, "key" => key).increment(1));
    }

    /// Counts a call or request of a caller who may not ask for it, by the word that says why.
    pub fn denied(&self, protocol: &'static str, reason: impl Into<SharedString>) {
        self.record(|| {
            counter!(REQUESTS_DENIED, "protocol" => protocol, "reason" => reason.into()).increment(1);
        });
    }

    /// Counts a connection that `listener` accepted, and as open until the answer is dropped.
    #[must_use]
    pub fn connection_opened(&self, listener: &'static str) -> OpenConnection {
        self.record(|| {
            counter!(CONNECTIONS_ACCEPTED, "listener" => listener).increment(1);
            gauge!(CONNECTIONS_OPEN, "listener" => listener).increment(1.0);
        });
        OpenConnection { metrics: self.clone(), listener }
    }

    /// Counts a connection that `listener` closed at once, since there was no place for it.
    pub fn connection_refused(&self, listener: &'static str) {
        self.record(|| counter!(CONNECTIONS_REFUSED, "listener" => listener).increment(1));
    }

    /// Says whether a file could be read again when it changed: false where it became something that cannot be used.
    pub fn file_reload(&self, file: &'static str, ok: bool) {
        self.record(|| gauge!(FILE_RELOAD_OK, "file" => file).set(f64::from(u8::from(ok))));
    }

    /// Says when the first certificate of the file that `setting` names expires, in seconds since 1970.
    pub fn certificate_expires(&self, setting: &'static str, timestamp_s: i64) {
        self.record(|| gauge!(CERTIFICATE_EXPIRES, "setting" => setting).set(timestamp_s as f64));
    }

    /// Says how many TLS handshakes have failed so far.
    pub fn handshakes_failed(&self, protocol: &'static str, total: u64) {
        self.record(|| counter!(HANDSHAKES_FAILED, "protocol" => protocol).absolute(total));
    }

    /// Says how much of what is limited is in use.
    pub fn in_use(&self, in_use: &InUse) {
        let InUse { requests, arriving, streams, watches, bytes } = *in_use;
        self.record(|| {
            gauge!(REQUESTS_IN_FLIGHT, "state" => "in_work").set(requests as f64);
            gauge!(REQUESTS_IN_FLIGHT, "state" => "arriving").set(arriving as f64);
            gauge!(STREAMS_OPEN).set(streams as f64);
            gauge!(WATCHES_OPEN).set(watches as f64);
            gauge!(BODY_BYTES).set(bytes as f64);
        });
    }

    /// Says how full disk and memory are, and whether changes are refused for it.
    pub fn room(&self, readings: &Readings, shortages: &[Shortage]) {
        self.record(|| {
            if let Some(bytes) = readings.disk_free_bytes {
                gauge!(DISK_FREE_BYTES).set(bytes as f64);
            }
            if let Some(memory) = readings.memory {
                gauge!(MEMORY_RESIDENT_BYTES).set(memory.resident_bytes as f64);
            }
            for reason in [Reason::DiskFull, Reason::MemoryFull] {
                let refused = shortages.iter().any(|shortage| shortage.reason() == reason);
                gauge!(WRITES_REFUSED, "reason" => reason.as_str()).set(f64::from(u8::from(refused)));
            }
        });
    }

    /// Counts a scan that was judged for insertion.
    pub(super) fn scan(&self, map: &MapName, scan: &JudgedScan) {
        self.0.maps.scan(map, scan.verdict);
        if let Some(how) = scan.recovered {
            self.0.maps.recovered(map, how);
        }
        let (robot, verdict) = (self.label_of_robot(&scan.robot), scan.verdict.as_str());
        self.record(|| {
            counter!(ROBOT_SCANS, "robot" => robot, "verdict" => verdict).increment(1);
            histogram!(SCAN_OVERLAP, "verdict" => verdict).record(scan.overlap);
            histogram!(ALIGN_SECONDS, "verdict" => verdict).record(scan.align_time);
        });
    }

    /// The robot's name, or the word for all those that came too late to have a series of their own.
    fn label_of_robot(&self, robot: &RobotName) -> String {
        let mut robots = self.0.robots.lock();
        if !robots.contains(robot) {
            if robots.len() >= Self::ROBOTS_MAX {
                return OTHER_ROBOTS.to_owned();
            }
            robots.insert(robot.clone());
        }
        robot.to_string()
    }

    /// Forgets what was counted of maps that are not among `names`.
    pub fn keep_maps(&self, names: &[MapName]) {
        self.0.maps.keep(names);
    }

    /// Notes what a node of a cluster knows of it.
    pub fn node(&self, reading: NodeReading) {
        *self.0.node.lock() = Some(reading);
    }

    /// Everything in Prometheus' text form, with what is known of the service now: a map that is gone leaves nothing
    /// behind.
    pub fn render(&self, service: &ServiceReading) -> String {
        let mut text = self.0.recorder.handle().render();
        exposition::write_counters(&mut text, &self.0.maps.of(&service.names));
        exposition::write_lanes(&mut text, &service.lanes);
        exposition::write_maps(&mut text, &service.maps);
        exposition::write_awake(&mut text, service.awake);
        exposition::write_unavailable(&mut text, &service.unavailable);
        if let Some(node) = &*self.0.node.lock() {
            write_node(&mut text, node, &service.shared);
        }
        text
    }

    /// Folds what was recorded into the histograms; to be called now and then, lest it pile up between scrapes.
    pub fn upkeep(&self) {
        self.0.recorder.handle().run_upkeep();
    }

    /// The name of a key, where not too many have come and gone already.
    fn label_of_key(&self, key: &str) -> String {
        let mut keys = self.0.keys.lock();
        if !keys.contains(key) {
            if keys.len() >= KEY_SERIES_MAX {
                return OTHER_KEYS.to_owned();
            }
            keys.insert(key.to_owned());
        }
        key.to_owned()
    }

    fn record(&self, f: impl FnOnce()) {
        with_local_recorder(&self.0.recorder, f);
    }
}

/// A connection that is counted as open.
#[derive(Debug)]
pub struct OpenConnection {
    metrics: Metrics,
    listener: &'static str,
}

impl Drop for OpenConnection {
    fn drop(&mut self) {
        self.metrics.record(|| gauge!(CONNECTIONS_OPEN, "listener" => self.listener).decrement(1.0));
    }
}

/// Counts what was done by map. Answers that were given before are not counted again.
impl Observer for Metrics {
    fn operation_ended(&self, ended: &Ended<'_>) {
        let (Some(map), End::Done(outcome)) = (ended.map, &ended.end) else { return };
        match outcome {
            Outcome::Points { lookup, points } => self.0.maps.points_queried(map, *lookup, *points),
            Outcome::Scan(scan) if !scan.replayed => self.scan(map, scan),
            Outcome::Changed(change) if !change.replayed => {
                let counted = [
                    (Family::VoxelsRemoved, change.voxels_removed),
                    (Family::VoxelsRestored, change.voxels_restored),
                    (Family::ScansUndone, change.scans_undone),
                    (Family::DeletionsUndone, change.deletions_undone),
                ];
                for (family, count) in counted.into_iter().filter(|(_, count)| *count > 0) {
                    self.0.maps.count(map, (family, None), count);
                }
            }
            Outcome::Read | Outcome::Scan(_) | Outcome::Changed(_) => {}
        }
    }
}
