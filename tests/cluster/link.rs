//! A connection between two processes that a test can cut.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

/// How often a connection looks whether it is cut.
const LOOKED_EVERY: Duration = Duration::from_millis(20);

/// What listens at a port, and passes on to another what comes. Cut, it takes connections and passes nothing on: like a
/// network that drops packets, and unlike a port that refuses.
pub(crate) struct Link {
    port: u16,
    state: Arc<State>,
}

#[derive(Default)]
struct State {
    is_cut: AtomicBool,
    /// How often it was mended: connections from before end then.
    mended: AtomicU64,
}

impl Link {
    /// To a port of this machine.
    pub(crate) fn to(target: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let state = Arc::<State>::default();
        let of_all = Arc::clone(&state);
        thread::spawn(move || {
            for incoming in listener.incoming() {
                let (Ok(incoming), state) = (incoming, Arc::clone(&of_all)) else { return };
                thread::spawn(move || pass_on(incoming, target, &state));
            }
        });
        Self { port, state }
    }

    /// Where it listens.
    pub(crate) fn port(&self) -> u16 {
        self.port
    }

    /// From now on nothing passes.
    pub(crate) fn cut(&self) {
        self.state.is_cut.store(true, Ordering::Release);
    }

    /// From now on connections that are made anew pass.
    pub(crate) fn mend(&self) {
        self.state.mended.fetch_add(1, Ordering::AcqRel);
        self.state.is_cut.store(false, Ordering::Release);
    }
}

fn pass_on(incoming: TcpStream, target: u16, state: &Arc<State>) {
    let begun = state.mended.load(Ordering::Acquire);
    while state.is_cut.load(Ordering::Acquire) {
        thread::sleep(LOOKED_EVERY);
    }
    if state.mended.load(Ordering::Acquire) != begun {
        return;
    }
    // Where nothing listens there, the connection ends at once.
    let Ok(outgoing) = TcpStream::connect(("127.0.0.1", target)) else { return };
    let (Ok(from), Ok(to)) = (incoming.try_clone(), outgoing.try_clone()) else { return };
    let of_back = Arc::clone(state);
    let back = thread::spawn(move || copy(outgoing, incoming, &of_back, begun));
    copy(from, to, state, begun);
    _ = back.join();
}

fn copy(mut from: TcpStream, mut to: TcpStream, state: &State, begun: u64) {
    from.set_read_timeout(Some(LOOKED_EVERY)).unwrap();
    from.set_nodelay(true).unwrap();
    let mut bytes = vec![0; 64 << 10];
    while state.mended.load(Ordering::Acquire) == begun {
        match from.read(&mut bytes) {
            Ok(0) => break,
            Ok(count) => {
                while state.is_cut.load(Ordering::Acquire) {
                    thread::sleep(LOOKED_EVERY);
                }
                if state.mended.load(Ordering::Acquire) != begun || to.write_all(&bytes[..count]).is_err() {
                    break;
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(_) => break,
        }
    }
    _ = from.shutdown(std::net::Shutdown::Both);
    _ = to.shutdown(std::net::Shutdown::Both);
}
