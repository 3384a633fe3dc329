//! A relay in front of a server, which counts.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;

use super::address::GrpcAddress;
use super::error::FleetError;

/// Bytes that are passed on at once.
const PIECE_BYTES: usize = 64 << 10;

/// Passes connections on to a server, and counts the bytes that come back.
pub(crate) struct Relay {
    address: SocketAddr,
    bytes: Arc<AtomicU64>,
    accepting: JoinHandle<()>,
}

impl Relay {
    /// Begins to listen, for a server at an address without a scheme.
    pub(crate) async fn start(server: &str) -> Result<Self, FleetError> {
        let listener = TcpListener::bind(super::process::ANY_PORT).await.map_err(FleetError::failed)?;
        let address = listener.local_addr().map_err(FleetError::failed)?;
        let (bytes, server) = (Arc::new(AtomicU64::new(0)), server.to_owned());
        let counted = Arc::clone(&bytes);
        let accepting = tokio::spawn(async move {
            while let Ok((client, _)) = listener.accept().await {
                if let Ok(server) = TcpStream::connect(&server).await {
                    tokio::spawn(pass_on(client, server, Arc::clone(&counted)));
                }
            }
        });
        Ok(Self { address, bytes, accepting })
    }

    /// Where clients find it.
    pub(crate) fn grpc(&self) -> GrpcAddress {
        GrpcAddress::open(format!("http://{}", self.address))
    }

    /// Bytes that the server has sent so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.accepting.abort();
    }
}

/// Passes both ways on until one of them ends.
async fn pass_on(client: TcpStream, server: TcpStream, bytes: Arc<AtomicU64>) {
    let ((mut from_client, mut to_client), (mut from_server, mut to_server)) =
        (client.into_split(), server.into_split());
    let back = async {
        let mut piece = vec![0; PIECE_BYTES];
        while let Ok(read @ 1..) = from_server.read(&mut piece).await {
            bytes.fetch_add(read as u64, Ordering::Relaxed);
            if to_client.write_all(&piece[..read]).await.is_err() {
                return;
            }
        }
    };
    tokio::select! {
        () = back => {}
        _ = tokio::io::copy(&mut from_client, &mut to_server) => {}
    }
}
