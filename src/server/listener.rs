//! Sockets that are listened on: what they accept is a stream of bytes, wherever it came from.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rustix::net::sockopt;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::sleep;

use super::error::ServerError;
use super::protocol::Protocol;
use super::socket::UnixSocket;
use super::stream::Stream;
use crate::access::{Peer, ReachedAt};
use mrol_client::wire::transport::KEEPALIVE_INTERVAL;

/// How long to wait after an error that the next connection would meet as well: too many open files.
const PAUSE: Duration = Duration::from_millis(100);

/// Connections that may wait to be accepted: one that finds no room tries again after a second. The system may set a
/// lower bound.
const WAITING_MAX: u32 = 4096;

/// A socket that is listened on. Dropping it ends that, and removes the file of a Unix socket.
#[derive(Debug)]
pub(super) enum Accepting {
    Tcp(Arc<TcpListener>),
    Unix(UnixSocket),
}

/// A connection, and where it came from.
pub(super) struct Accepted {
    pub(super) stream: Stream,
    pub(super) peer: Peer,
    /// None where the system does not say.
    pub(super) at: Option<ReachedAt>,
}

/// A TCP address that is listened on; a clone is another handle on the same socket.
#[derive(Debug, Clone)]
pub(super) struct TcpSocket {
    pub(super) listener: Arc<TcpListener>,
    pub(super) address: SocketAddr,
}

impl TcpSocket {
    /// # Errors
    /// When the address is taken, or is none of this machine's.
    pub(super) fn bind(protocol: Protocol, address: SocketAddr) -> Result<Self, ServerError> {
        let listen = |error| ServerError::Listen { protocol: protocol.as_str(), address, error };
        let listener = listener(address).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        Ok(Self { listener: listener.into(), address })
    }
}

impl Accepting {
    /// The next connection. What goes wrong with one, or for lack of files for a while, does not end it.
    pub(super) async fn next(&self) -> Accepted {
        loop {
            match self.accept().await {
                Ok(stream) => return stream,
                Err(error) if is_of_one_connection(&error) => {}
                Err(error) => {
                    tracing::warn!(%error, "no connection can be accepted");
                    sleep(PAUSE).await;
                }
            }
        }
    }

    async fn accept(&self) -> io::Result<Accepted> {
        match self {
            Self::Tcp(listener) => {
                let (stream, from) = listener.accept().await?;
                prepare(&stream);
                let at = stream.local_addr().ok().map(|at| ReachedAt::Address(at.ip()));
                Ok(Accepted { stream: Box::new(stream), peer: Peer::Address(from.ip()), at })
            }
            Self::Unix(UnixSocket { listener, .. }) => {
                let (stream, _) = listener.accept().await?;
                let at = Some(ReachedAt::UnixSocket);
                Ok(Accepted { stream: Box::new(stream), peer: Peer::Local, at })
            }
        }
    }
}

fn listener(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = match address {
        SocketAddr::V4(_) => tokio::net::TcpSocket::new_v4(),
        SocketAddr::V6(_) => tokio::net::TcpSocket::new_v6(),
    }?;
    // A server that comes back need not wait for the last connections of the one before.
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(WAITING_MAX)
}

/// Answers go out at once; a peer that vanished without a word is found out.
fn prepare(stream: &TcpStream) {
    // A connection that refuses is slower, or stays for longer, and is not broken.
    let _ = stream.set_nodelay(true);
    let _ = sockopt::set_socket_keepalive(stream, true);
    let _ = sockopt::set_tcp_keepidle(stream, KEEPALIVE_INTERVAL);
}

fn is_of_one_connection(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset};
    matches!(error.kind(), ConnectionAborted | ConnectionRefused | ConnectionReset)
}
