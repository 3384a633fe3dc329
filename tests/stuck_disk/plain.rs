//! A gRPC connection that gives up no call by itself, as tonic's own does at the call's deadline: what is seen here is
//! what the server does about deadlines.

use std::pin::Pin;
use std::task::{Context, Poll};

use hyper::body::Incoming;
use hyper::client::conn::http2::{self, SendRequest};
use hyper::{Request, Response, Uri};
use hyper_util::rt::{TokioExecutor, TokioIo};
use mrol::wire::pb::mapping_client::MappingClient;
use mrol::wire::pb::maps_client::MapsClient;
use mrol::wire::pb::occupancy_client::OccupancyClient;
use tokio::net::TcpStream;
use tonic::body::Body;
use tonic::codegen::Service;

const WINDOW_BYTES: u32 = 8 << 20;
const MESSAGE_BYTES_MAX: usize = 256 << 20;

/// A connection.
#[derive(Clone)]
pub(crate) struct Plain {
    requests: SendRequest<Body>,
    origin: Uri,
}

impl Plain {
    pub(crate) async fn connect(url: &str) -> Self {
        let origin: Uri = url.parse().unwrap();
        let stream = TcpStream::connect(origin.authority().unwrap().as_str()).await.expect("a connection");
        stream.set_nodelay(true).unwrap();
        let mut settings = http2::Builder::new(TokioExecutor::new());
        settings.initial_stream_window_size(WINDOW_BYTES).initial_connection_window_size(2 * WINDOW_BYTES);
        let (requests, connection) = settings.handshake(TokioIo::new(stream)).await.expect("HTTP/2");
        tokio::spawn(connection);
        Self { requests, origin }
    }

    pub(crate) fn mapping(&self) -> MappingClient<Self> {
        MappingClient::with_origin(self.clone(), self.origin.clone())
            .max_decoding_message_size(MESSAGE_BYTES_MAX)
    }

    pub(crate) fn maps(&self) -> MapsClient<Self> {
        MapsClient::with_origin(self.clone(), self.origin.clone())
    }

    pub(crate) fn occupancy(&self) -> OccupancyClient<Self> {
        OccupancyClient::with_origin(self.clone(), self.origin.clone())
            .max_decoding_message_size(MESSAGE_BYTES_MAX)
    }
}

impl Service<Request<Body>> for Plain {
    type Response = Response<Incoming>;
    type Error = hyper::Error;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Response, Self::Error>> + Send>>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Self::Error>> {
        self.requests.poll_ready(context)
    }

    fn call(&mut self, request: Request<Body>) -> Self::Future {
        Box::pin(self.requests.send_request(request))
    }
}
