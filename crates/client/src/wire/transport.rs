//! Numbers that both ends of a gRPC connection set, since HTTP/2's own defaults are made for small pages.

use std::time::Duration;

use mrol_service::Limits;

/// Bytes of one message, at most, where nothing else is set. tonic's own limit for reading is 4 MB.
pub const MESSAGE_BYTES_MAX: usize = Limits::MESSAGE_BYTES_MAX;
/// Bytes of one stream that may be under way unacknowledged; the reader's number counts.
pub const STREAM_WINDOW_BYTES: u32 = 4 << 20;
/// Bytes of all streams of a connection that may be under way unacknowledged.
pub const CONNECTION_WINDOW_BYTES: u32 = 16 << 20;
/// The same of a stream where many watches share a connection: a reader that stands still keeps what one stream may
/// have under way, and never what others need.
pub const WATCH_WINDOW_BYTES: u32 = 64 << 10;
/// Bytes of all watches of such a connection: room for each of so many as a server takes.
pub const WATCHES_WINDOW_BYTES: u32 = 128 * WATCH_WINDOW_BYTES;
/// Bytes of one frame: a connection may hold as many for one that never ends.
pub const FRAME_BYTES_MAX: u32 = 64 << 10;
/// How often an idle peer is asked whether it is there,
pub const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(20);
/// and how long it may take to answer.
pub const KEEPALIVE_TIMEOUT: Duration = Duration::from_secs(10);
