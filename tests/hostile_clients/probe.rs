//! Who asks `/livez` all the time, as an orchestrator does: a connection for each question.

use std::fmt::{Display, Formatter};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

/// How long an answer may take where nobody says otherwise.
const PATIENCE: Duration = Duration::from_secs(2);
const INTERVAL: Duration = Duration::from_millis(10);

/// A thread of its own, so that whoever attacks from this process does not delay it.
pub(crate) struct Probe {
    enough: Arc<AtomicBool>,
    thread: JoinHandle<Answers>,
}

/// How long each answer took, ascending.
pub(crate) struct Answers(Vec<Duration>);

impl Probe {
    pub(crate) fn begin(server: SocketAddr) -> Self {
        let enough = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&enough);
        let thread = std::thread::spawn(move || {
            let mut times = Vec::new();
            // One at the least, however soon it is enough.
            loop {
                times.push(answer_time(server));
                if told.load(Ordering::Relaxed) {
                    break;
                }
                sleep(INTERVAL);
            }
            times.sort_unstable();
            Answers(times)
        });
        Self { enough, thread }
    }

    pub(crate) fn end(self) -> Answers {
        self.enough.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

/// From the first packet to the last.
fn answer_time(server: SocketAddr) -> Duration {
    let start = Instant::now();
    let mut connection = TcpStream::connect_timeout(&server, 2 * PATIENCE).expect("a connection for /livez");
    connection.set_read_timeout(Some(2 * PATIENCE)).unwrap();
    connection.write_all(b"GET /livez HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    connection.read_to_string(&mut answer).expect("an answer of /livez");
    assert!(answer.starts_with("HTTP/1.1 200"), "/livez: {answer:?}");
    start.elapsed()
}

/// What is too long: `MROL_LIVEZ_MS`, for machines that do nothing else.
fn longest() -> Duration {
    std::env::var("MROL_LIVEZ_MS").map_or(PATIENCE, |ms| Duration::from_millis(ms.parse().unwrap()))
}

impl Answers {
    fn worst(&self) -> Duration {
        self.0[self.0.len() - 1]
    }

    fn percentile_99(&self) -> Duration {
        self.0[self.0.len() * 99 / 100]
    }

    pub(crate) fn assert_alive(&self) {
        let (worst, longest) = (self.worst(), longest());
        assert!(worst <= longest, "/livez took {worst:?}, {longest:?} is the bound");
    }
}

impl Display for Answers {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "worst {:.1?}, p99 {:.1?} of {}", self.worst(), self.percentile_99(), self.0.len())
    }
}
