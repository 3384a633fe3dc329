//! A way to a server that can be cut, or keep its answers back.

use std::net::SocketAddr;
use std::sync::Arc;

use parking_lot::Mutex;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Whole,
    /// Requests arrive, and answers do not.
    Mute,
    /// Connections end, and no other is taken.
    Cut,
}

/// Carries connections to a server and back.
pub(super) struct Line {
    pub(super) address: SocketAddr,
    state: watch::Sender<State>,
    sent: Arc<Mutex<Vec<u8>>>,
}

impl Line {
    /// A line to the server at `server`.
    pub(super) async fn to(server: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let (state, watched) = watch::channel(State::Whole);
        let sent = Arc::default();
        let (bytes, mut over) = (Arc::clone(&sent), watched.clone());
        tokio::spawn(async move {
            let accepting = async {
                loop {
                    let (client, _) = listener.accept().await.unwrap();
                    let carried = carry(client, server, watched.clone(), Arc::clone(&bytes));
                    let mut over = watched.clone();
                    tokio::spawn(async move {
                        tokio::select! {
                            () = carried => {}
                            _ = over.wait_for(|state| *state == State::Cut) => {}
                        }
                    });
                }
            };
            tokio::select! {
                () = accepting => {}
                _ = over.wait_for(|state| *state == State::Cut) => {}
            }
        });
        Self { address, state, sent }
    }

    /// Keeps answers back from now on.
    pub(super) fn mute(&self) {
        self.state.send_replace(State::Mute);
    }

    /// Ends all connections, and takes none from now on.
    pub(super) async fn cut(&self) {
        self.state.send_replace(State::Cut);
        // Until the listener is gone, too.
        while TcpStream::connect(self.address).await.is_ok() {
            tokio::task::yield_now().await;
        }
    }

    /// How many bytes clients have sent.
    pub(super) fn sent_bytes(&self) -> usize {
        self.sent.lock().len()
    }

    /// How often clients have sent a text.
    pub(super) fn times_sent(&self, text: &str) -> usize {
        self.sent.lock().windows(text.len()).filter(|window| *window == text.as_bytes()).count()
    }
}

async fn carry(
    client: TcpStream,
    server: SocketAddr,
    state: watch::Receiver<State>,
    sent: Arc<Mutex<Vec<u8>>>,
) {
    let server = TcpStream::connect(server).await.unwrap();
    let ((from_client, to_client), (from_server, to_server)) = (client.into_split(), server.into_split());
    let there = pump(from_client, to_server, |bytes| {
        sent.lock().extend_from_slice(bytes);
        true
    });
    let back = pump(from_server, to_client, |_| *state.borrow() == State::Whole);
    tokio::join!(there, back);
}

/// Carries what `passes` lets through, until one side ends.
async fn pump(mut from: OwnedReadHalf, mut to: OwnedWriteHalf, passes: impl Fn(&[u8]) -> bool) {
    let mut bytes = vec![0; 64 << 10];
    while let Ok(count @ 1..) = from.read(&mut bytes).await {
        if passes(&bytes[..count]) && to.write_all(&bytes[..count]).await.is_err() {
            return;
        }
    }
}
