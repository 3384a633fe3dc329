//! A connection between two processes that a test can cut.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

/// How often a connection looks whether it is cut.
const LOOKED_EVERY: Duration = Duration::from_millis(20);

/// How often it tries to listen at its port, and the pause between.
const BINDS_MAX: usize = 50;
const BOUND_EVERY: Duration = Duration::from_millis(100);

/// How often it takes connections.
const ACCEPTED_EVERY: Duration = Duration::from_millis(5);

/// What listens at a port, and passes on to another what comes. Cut, it takes connections and passes nothing on: like a
/// network that drops packets, and unlike a port that refuses.
pub(crate) struct Link {
    port: u16,
    state: Arc<State>,
}

#[derive(Default)]
struct State {
    is_cut: AtomicBool,
    /// True while it listens at no port, as where its target has ended.
    is_closed: AtomicBool,
    /// How often it was mended: connections from before end then.
    mended: AtomicU64,
}

impl Link {
    /// From some port to a port of this machine.
    pub(crate) fn to(target: u16) -> Self {
        Self::between(0, target)
    }

    /// From one port of this machine to another. A port that was free a moment ago may still be let go of.
    pub(crate) fn between(port: u16, target: u16) -> Self {
        let listener = (0..BINDS_MAX).find_map(|_| {
            let bound = TcpListener::bind(("127.0.0.1", port));
            bound.inspect_err(|_| thread::sleep(BOUND_EVERY)).ok()
        });
        let listener = listener.expect("the port is not let go of");
        let port = listener.local_addr().unwrap().port();
        let state = Arc::<State>::default();
        let of_all = Arc::clone(&state);
        thread::spawn(move || listen(listener, port, target, &of_all));
        Self { port, state }
    }

    /// From now on its port refuses connections.
    pub(crate) fn close(&self) {
        self.state.is_closed.store(true, Ordering::Release);
    }

    /// From now on its port takes connections.
    pub(crate) fn open(&self) {
        self.state.is_closed.store(false, Ordering::Release);
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

fn listen(listener: TcpListener, port: u16, target: u16, state: &Arc<State>) {
    let mut listener = Some(listener);
    loop {
        thread::sleep(ACCEPTED_EVERY);
        if state.is_closed.load(Ordering::Acquire) {
            listener = None;
            continue;
        }
        let open = listener.get_or_insert_with(|| TcpListener::bind(("127.0.0.1", port)).unwrap());
        open.set_nonblocking(true).unwrap();
        while let Ok((incoming, _)) = open.accept() {
            incoming.set_nonblocking(false).unwrap();
            let state = Arc::clone(state);
            thread::spawn(move || pass_on(incoming, target, &state));
        }
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
