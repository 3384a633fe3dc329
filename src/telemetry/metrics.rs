//! Counters and latencies, kept by one server and rendered for Prometheus.

use std::sync::Arc;
use std::time::Duration;

use metrics::{
    SharedString, counter, describe_counter, describe_gauge, describe_histogram, gauge, histogram,
    with_local_recorder,
};
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusRecorder};

use super::exposition;
use super::log::TelemetryError;
use crate::admission::InUse;
use crate::align::Verdict;
use crate::map::{Lookup, MapName};
use crate::service::{MapInfo, PoolUse, Readings, Shortage};

/// Upper bounds of the latency histogram, seconds: a small query takes 0.1 ms, an alignment up to seconds.
const SECONDS_BUCKETS: [f64; 14] =
    [0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 2.5, 10.0];

const REQUESTS: &str = "mrol_requests_total";
const REQUEST_SECONDS: &str = "mrol_request_seconds";
const KEY_REQUESTS: &str = "mrol_key_requests_total";
const FILE_IN_FORCE: &str = "mrol_file_in_force";
const CERTIFICATE_EXPIRES: &str = "mrol_certificate_expires_timestamp_seconds";
const HANDSHAKES_FAILED: &str = "mrol_tls_handshakes_failed_total";
const REQUESTS_IN_FLIGHT: &str = "mrol_requests_in_flight";
const STREAMS_OPEN: &str = "mrol_streams_open";
const BODY_BYTES: &str = "mrol_body_bytes";
const DISK_FREE_BYTES: &str = "mrol_disk_free_bytes";
const MEMORY_RESIDENT_BYTES: &str = "mrol_memory_resident_bytes";
const WRITES_REFUSED: &str = "mrol_writes_refused";
const POINTS_QUERIED: &str = "mrol_points_queried_total";
const SCANS: &str = "mrol_scans_total";
const SCANS_UNDONE: &str = "mrol_scans_undone_total";
const VOXELS_REMOVED: &str = "mrol_voxels_removed_total";

/// The metrics of one server. A clone is another handle on the same ones.
///
/// The recorder is the server's own and not the process's, so that several servers in one process (tests, a
/// demo) count apart.
#[derive(Debug, Clone)]
pub struct Metrics(Arc<PrometheusRecorder>);

impl Metrics {
    /// Metrics that are all zero.
    ///
    /// # Errors
    /// When the recorder refuses the buckets.
    pub fn new() -> Result<Self, TelemetryError> {
        let latency = Matcher::Full(REQUEST_SECONDS.to_owned());
        let builder = PrometheusBuilder::new().set_buckets_for_metric(latency, &SECONDS_BUCKETS)?;
        let metrics = Self(Arc::new(builder.build_recorder()));
        metrics.record(describe);
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
        self.record(|| counter!(KEY_REQUESTS, "protocol" => protocol, "key" => key.to_owned()).increment(1));
    }

    /// Says whether what a file holds is in force: false where it changed into something that cannot be used.
    pub fn file_in_force(&self, file: &'static str, in_force: bool) {
        self.record(|| gauge!(FILE_IN_FORCE, "file" => file).set(f64::from(u8::from(in_force))));
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
        let InUse { requests, arriving, streams, bytes } = *in_use;
        self.record(|| {
            gauge!(REQUESTS_IN_FLIGHT, "state" => "in_work").set(requests as f64);
            gauge!(REQUESTS_IN_FLIGHT, "state" => "arriving").set(arriving as f64);
            gauge!(STREAMS_OPEN).set(streams as f64);
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
            for reason in [Shortage::DISK_FULL, Shortage::MEMORY_FULL] {
                let refused = shortages.iter().any(|shortage| shortage.reason() == reason);
                gauge!(WRITES_REFUSED, "reason" => reason).set(f64::from(u8::from(refused)));
            }
        });
    }

    /// Counts points that were answered.
    pub fn points_queried(&self, map: &MapName, lookup: Lookup, points: usize) {
        let lookup = match lookup {
            Lookup::Exact => "exact",
            Lookup::Bloom => "bloom",
        };
        self.record(|| {
            counter!(POINTS_QUERIED, "map" => map.to_string(), "lookup" => lookup).increment(points as u64);
        });
    }

    /// Counts a scan that was judged for insertion.
    pub fn scan(&self, map: &MapName, verdict: Verdict) {
        self.record(|| counter!(SCANS, "map" => map.to_string(), "verdict" => verdict.as_str()).increment(1));
    }

    /// Counts scans that were taken out again.
    pub fn scans_undone(&self, map: &MapName, scans: usize) {
        self.record(|| counter!(SCANS_UNDONE, "map" => map.to_string()).increment(scans as u64));
    }

    /// Counts finest voxels that a deletion or an undo removed.
    pub fn voxels_removed(&self, map: &MapName, voxels: usize) {
        self.record(|| counter!(VOXELS_REMOVED, "map" => map.to_string()).increment(voxels as u64));
    }

    /// Everything in Prometheus' text form, with gauges of `pools` and `maps` as they are now: a map that is gone leaves no
    /// gauge behind.
    pub fn render(&self, pools: &[PoolUse], maps: &[MapInfo]) -> String {
        let mut text = self.0.handle().render();
        exposition::write_pools(&mut text, pools);
        exposition::write_maps(&mut text, maps);
        text
    }

    /// Folds what was recorded into the histograms; to be called now and then, lest it pile up between scrapes.
    pub fn upkeep(&self) {
        self.0.handle().run_upkeep();
    }

    fn record(&self, f: impl FnOnce()) {
        with_local_recorder(&*self.0, f);
    }
}

fn describe() {
    describe_counter!(REQUESTS, "Requests and messages of streams answered, by protocol, operation and code");
    describe_histogram!(REQUEST_SECONDS, "Seconds from request to answer, by protocol and operation");
    describe_counter!(KEY_REQUESTS, "Calls and requests let in, by protocol and name of their key");
    describe_gauge!(
        FILE_IN_FORCE,
        "0 where a file changed into what cannot be used, and what it held before goes on"
    );
    describe_gauge!(
        CERTIFICATE_EXPIRES,
        "When the first certificate of a file expires, in seconds since 1970"
    );
    describe_counter!(HANDSHAKES_FAILED, "TLS handshakes that failed, by protocol");
    describe_gauge!(REQUESTS_IN_FLIGHT, "Requests in work, and those whose bodies are arriving, by state");
    describe_gauge!(STREAMS_OPEN, "Calls whose client streams messages");
    describe_gauge!(
        BODY_BYTES,
        "Bytes of bodies that have arrived, and of listings and map files on their way out"
    );
    describe_gauge!(DISK_FREE_BYTES, "Bytes free on the disk of the data folder");
    describe_gauge!(MEMORY_RESIDENT_BYTES, "Bytes that the process has in memory");
    describe_gauge!(WRITES_REFUSED, "1 while changes are refused, by reason");
    describe_counter!(POINTS_QUERIED, "Points answered, by map and look-up");
    describe_counter!(SCANS, "Scans judged for insertion, by map and verdict");
    describe_counter!(SCANS_UNDONE, "Scans taken out again, by map");
    describe_counter!(VOXELS_REMOVED, "Finest voxels removed by deletions and undos, by map");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_counted_is_rendered_with_its_description() {
        let metrics = Metrics::new().unwrap();
        let map = MapName::new("a").unwrap();
        metrics.request("grpc", "QueryPoints", "ok", Duration::from_millis(3));
        metrics.points_queried(&map, Lookup::Bloom, 7);
        metrics.points_queried(&map, Lookup::Bloom, 5);
        metrics.scan(&map, Verdict::LowOverlap);
        let text = metrics.render(&[], &[]);
        for line in [
            r#"mrol_requests_total{protocol="grpc",operation="QueryPoints",code="ok"} 1"#,
            r#"mrol_request_seconds_bucket{protocol="grpc",operation="QueryPoints",le="0.005"} 1"#,
            r#"mrol_points_queried_total{map="a",lookup="bloom"} 12"#,
            r#"mrol_scans_total{map="a",verdict="low_overlap"} 1"#,
            "# TYPE mrol_request_seconds histogram",
            "# HELP mrol_scans_total Scans judged",
        ] {
            assert!(text.contains(line), "{line} is not in\n{text}");
        }
    }

    #[test]
    fn two_servers_count_apart() {
        let (one, other) = (Metrics::new().unwrap(), Metrics::new().unwrap());
        one.request("http", "GetMap", "200", Duration::ZERO);
        assert!(!other.render(&[], &[]).contains("GetMap"));
    }
}
