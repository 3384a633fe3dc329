//! The metrics that are counted as things happen: their names, and what each says.

use metrics::{describe_counter, describe_gauge, describe_histogram};

pub(super) const BUILD_INFO: &str = "mrol_build_info";
pub(super) const REQUESTS: &str = "mrol_requests_total";
pub(super) const REQUEST_SECONDS: &str = "mrol_request_seconds";
pub(super) const KEY_REQUESTS: &str = "mrol_key_requests_total";
pub(super) const REQUESTS_DENIED: &str = "mrol_requests_denied_total";
pub(super) const CONNECTIONS_ACCEPTED: &str = "mrol_connections_accepted_total";
pub(super) const CONNECTIONS_REFUSED: &str = "mrol_connections_refused_total";
pub(super) const CONNECTIONS_OPEN: &str = "mrol_connections_open";
pub(super) const FILE_RELOAD_OK: &str = "mrol_file_reload_ok";
pub(super) const CERTIFICATE_EXPIRES: &str = "mrol_certificate_expires_timestamp_seconds";
pub(super) const HANDSHAKES_FAILED: &str = "mrol_tls_handshakes_failed_total";
pub(super) const REQUESTS_IN_FLIGHT: &str = "mrol_requests_in_flight";
pub(super) const STREAMS_OPEN: &str = "mrol_streams_open";
pub(super) const WATCHES_OPEN: &str = "mrol_watches_open";
pub(super) const BODY_BYTES: &str = "mrol_body_bytes";
pub(super) const DISK_FREE_BYTES: &str = "mrol_disk_free_bytes";
pub(super) const MEMORY_RESIDENT_BYTES: &str = "mrol_memory_resident_bytes";
pub(super) const WRITES_REFUSED: &str = "mrol_writes_refused";
pub(super) const ROBOT_SCANS: &str = "mrol_robot_scans_total";
pub(super) const SCAN_OVERLAP: &str = "mrol_scan_overlap";
pub(super) const ALIGN_SECONDS: &str = "mrol_scan_align_seconds";

/// Tells the recorder in force what each of them says.
pub(crate) fn describe() {
    describe_gauge!(BUILD_INFO, "1, with the version, the commit and the features that were built");
    describe_counter!(REQUESTS, "Requests and messages of streams answered, by protocol, operation and code");
    describe_histogram!(REQUEST_SECONDS, "Seconds from request to answer, by protocol and operation");
    describe_counter!(KEY_REQUESTS, "Calls and requests let in, by protocol and name of their key");
    describe_counter!(
        REQUESTS_DENIED,
        "Calls and requests of callers who may not ask for them, by protocol and reason"
    );
    describe_counter!(CONNECTIONS_ACCEPTED, "Connections accepted, by listener");
    describe_counter!(CONNECTIONS_REFUSED, "Connections closed at once for want of a place, by listener");
    describe_gauge!(CONNECTIONS_OPEN, "Connections that are open, by listener");
    describe_gauge!(
        FILE_RELOAD_OK,
        "0 where a file changed into what cannot be used, and what it held before goes on"
    );
    describe_gauge!(
        CERTIFICATE_EXPIRES,
        "When the first certificate of a file expires, in seconds since 1970"
    );
    describe_counter!(HANDSHAKES_FAILED, "TLS handshakes that failed, by protocol");
    describe_gauge!(REQUESTS_IN_FLIGHT, "Requests in work, and those whose bodies are arriving, by state");
    describe_gauge!(STREAMS_OPEN, "Calls whose client streams messages");
    describe_gauge!(WATCHES_OPEN, "Watches of maps");
    describe_gauge!(
        BODY_BYTES,
        "Bytes of bodies that have arrived, and of listings and map files on their way out"
    );
    describe_gauge!(DISK_FREE_BYTES, "Bytes free on the disk of the data folder");
    describe_gauge!(MEMORY_RESIDENT_BYTES, "Bytes that the process has in memory");
    describe_gauge!(WRITES_REFUSED, "1 while changes are refused, by reason");
    describe_counter!(
        ROBOT_SCANS,
        "Scans judged for insertion, by robot (those after the first hundred as other) and verdict"
    );
    describe_histogram!(
        SCAN_OVERLAP,
        "Fraction of the points of scans judged for insertion in occupied voxels of level 0, by verdict"
    );
    describe_histogram!(
        ALIGN_SECONDS,
        "Seconds that the alignment of scans judged for insertion took, by verdict"
    );
}
