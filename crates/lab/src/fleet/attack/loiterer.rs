//! Connections on which nothing is asked, or half of something.

use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::aim::Aim;
use crate::fleet::error::FleetError;

/// How long a connection is left alone, where the server does not end it before.
const IDLE: Duration = Duration::from_secs(60);

/// The beginning of a request over HTTP.
const HALF_OF_HTTP: &[u8] = b"POST /v1/maps HTTP/1.1\r\nhost: loc";
/// The beginning of a connection of HTTP/2.
const HALF_OF_GRPC: &[u8] = b"PRI * HTTP/2.0\r\n";

/// Opens a connection to one of both protocols, on every other one half of a request, and leaves it alone until the
/// server ends it.
pub(super) async fn loiter(aim: &Aim, number: usize) -> Result<(), FleetError> {
    let (address, half) = if number & 1 == 0 { (&aim.http, HALF_OF_HTTP) } else { (&aim.grpc, HALF_OF_GRPC) };
    let address = address.trim_start_matches("http://");
    let mut connection = TcpStream::connect(address).await.map_err(FleetError::failed)?;
    if number & 2 == 0 {
        connection.write_all(half).await.map_err(FleetError::failed)?;
    }
    let mut bytes = [0; 64];
    loop {
        match timeout(IDLE, connection.read(&mut bytes)).await {
            Ok(Ok(0)) | Err(_) => return Ok(()),
            Ok(Ok(_)) => {}
            Ok(Err(error)) => return Err(FleetError::failed(error)),
        }
    }
}
