//! Watchers that stopped reading.

use std::net::SocketAddr;

use tokio::io::AsyncWriteExt;
use tokio::net::{TcpSocket, TcpStream};

use super::error::FleetError;
use mrol_map::map::MapName;

/// Bytes that may lie unread at a watcher: little, so that its server has to wait soon.
const UNREAD_BYTES: u32 = 4096;

/// A watch over HTTP of which nothing is read. It lasts until this is dropped, or the server ends it.
pub(crate) struct StalledWatch {
    /// Open for as long as the watch.
    _stream: TcpStream,
}

impl StalledWatch {
    /// Begins to watch a map, and stops to read before the first byte.
    pub(crate) async fn begin(http: &str, map: &MapName) -> Result<Self, FleetError> {
        let address: SocketAddr = http.trim_start_matches("http://").parse().map_err(FleetError::failed)?;
        let socket = TcpSocket::new_v4().map_err(FleetError::failed)?;
        socket.set_recv_buffer_size(UNREAD_BYTES).map_err(FleetError::failed)?;
        let mut stream = socket.connect(address).await.map_err(FleetError::failed)?;
        let request = format!("GET /v1/maps/{map}/watch HTTP/1.1\r\nhost: {address}\r\n\r\n");
        stream.write_all(request.as_bytes()).await.map_err(FleetError::failed)?;
        stream.readable().await.map_err(FleetError::failed)?;
        Ok(Self { _stream: stream })
    }
}
