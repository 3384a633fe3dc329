//! What HTTP/1 and HTTP/2 may take of a connection, for each protocol of the daemon.

use std::time::Duration;

use hyper::rt::Executor;
use hyper_util::rt::TokioTimer;
use hyper_util::server::conn::auto::Builder;

use mrol_client::wire::transport;
use mrol_map::sync::polled_by_runtime;
use mrol_service::Limits;

/// Streams of one HTTP/2 connection at once.
const STREAMS_PER_CONNECTION_MAX: u32 = 128;
/// Bytes of a request's headers, over HTTP/2 all of them and over HTTP/1 as they come.
const HEADER_BYTES_MAX: u32 = 32 << 10;
const HTTP1_BUFFER_BYTES_MAX: usize = 64 << 10;
/// Headers of a request over HTTP/1.
const HEADERS_MAX: usize = 100;
/// Streams that a client reset before they were begun, and that were reset for errors of the client: who causes more
/// of either is disconnected.
const EARLY_RESETS_MAX: usize = 20;
const ERROR_RESETS_MAX: usize = 128;
/// Bytes by which a gRPC client shows that it is one: HTTP/2's preface.
const PREFACE_BYTES: usize = 24;

/// Spawns the tasks of connections on the runtime, known as its tasks to the checks of [`mrol_map::sync`].
#[derive(Debug, Clone, Copy)]
pub(super) struct RuntimeExecutor;

impl<F: Future<Output: Send> + Send + 'static> Executor<F> for RuntimeExecutor {
    fn execute(&self, task: F) {
        tokio::spawn(polled_by_runtime(task));
    }
}

/// What the daemon speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Protocol {
    /// HTTP/1 and HTTP/2.
    Http,
    /// Over HTTP/2 alone.
    Grpc,
    /// Health and metrics alone, over HTTP/1 and HTTP/2.
    Admin,
}

impl Protocol {
    pub(super) fn as_str(self) -> &'static str {
        match self {
            Self::Http => "http",
            Self::Grpc => "grpc",
            Self::Admin => "admin",
        }
    }

    /// Bytes that a client sends before anything else, at least.
    pub(super) fn opening_bytes(self) -> usize {
        match self {
            Self::Http | Self::Admin => 1,
            Self::Grpc => PREFACE_BYTES,
        }
    }

    /// How long a connection without a request may stay.
    pub(super) fn idle_max(self, limits: &Limits) -> Duration {
        Duration::from_secs_f64(match self {
            Self::Http | Self::Admin => limits.http_idle_max_s,
            Self::Grpc => limits.grpc_idle_max_s,
        })
    }

    /// What serves its connections.
    pub(super) fn builder(self, limits: &Limits) -> Builder<RuntimeExecutor> {
        let mut builder = Builder::new(RuntimeExecutor);
        builder
            .http1()
            .timer(TokioTimer::new())
            // From the first of its bytes, or from the last answer on.
            .header_read_timeout(self.idle_max(limits))
            .max_headers(HEADERS_MAX)
            .max_buf_size(HTTP1_BUFFER_BYTES_MAX);
        builder
            .http2()
            .timer(TokioTimer::new())
            .initial_stream_window_size(transport::STREAM_WINDOW_BYTES)
            .initial_connection_window_size(transport::CONNECTION_WINDOW_BYTES)
            .max_frame_size(transport::FRAME_BYTES_MAX)
            .max_concurrent_streams(STREAMS_PER_CONNECTION_MAX)
            .max_header_list_size(HEADER_BYTES_MAX)
            .max_pending_accept_reset_streams(EARLY_RESETS_MAX)
            .max_local_error_reset_streams(ERROR_RESETS_MAX)
            .keep_alive_interval(transport::KEEPALIVE_INTERVAL)
            .keep_alive_timeout(transport::KEEPALIVE_TIMEOUT);
        match self {
            Self::Http | Self::Admin => builder,
            Self::Grpc => builder.http2_only(),
        }
    }
}
