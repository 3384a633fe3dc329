//! Who asks `/livez` a hundred times a second, and each map about 10,000 points, from a process of its own: this one
//! again, so that nothing of the load delays it.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

use crate::MAPS;
use crate::report::{Bound, Report};
use crate::support::daemon::{bytes_of, row};
use crate::support::watchdog::Beat;

const ADDRESS: &str = "MROL_STUCK_DISK_PROBE";
const MARK: &str = "answered";
const LIVEZ_INTERVAL: Duration = Duration::from_millis(10);
const QUERY_INTERVAL: Duration = Duration::from_millis(50);
const QUERY_POINTS: usize = 10_000;
/// More than any bound: whoever gives up later than this says so.
const PATIENCE: Duration = Duration::from_secs(60);

/// The process, and who listens to it.
pub(crate) struct Prober {
    process: Child,
    listening: JoinHandle<()>,
}

impl Prober {
    pub(crate) fn begin(http: &str, report: Arc<Report>, heart: Beat) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["prober::asks_where_another_test_says", "--exact", "--nocapture"]);
        command.env(ADDRESS, http.strip_prefix("http://").unwrap());
        let mut process = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(process.stdout.take().unwrap()).lines();
        let listening = std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                // The harness writes the test's name into the first line.
                let Some((_, answer)) = line.split_once(&format!("{MARK} ")) else { continue };
                let (us, rest) = answer.split_once(' ').unwrap();
                let (outcome, kind) = rest.split_once(' ').unwrap();
                let took = Duration::from_micros(us.parse().unwrap());
                report.note(&format!("probe:{kind}"), Bound::Answer, took, outcome);
                heart.beat();
            }
        });
        Self { process, listening }
    }

    /// Waits for what was asked last.
    pub(crate) fn end(mut self) {
        drop(self.process.stdin.take());
        assert!(self.process.wait().unwrap().success(), "the prober failed");
        self.listening.join().unwrap();
    }
}

/// The process's own main function.
#[test]
fn asks_where_another_test_says() {
    let Ok(server) = std::env::var(ADDRESS) else { return };
    let server: SocketAddr = server.parse().unwrap();
    let livez = b"GET /livez HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n".to_vec();
    std::thread::spawn(move || ask_all_the_time(server, "/livez", &livez, LIVEZ_INTERVAL));
    for map in MAPS {
        let body = bytes_of(&row(QUERY_POINTS));
        let mut query = format!(
            "POST /v1/maps/{map}/occupancy HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\
             content-type: application/octet-stream\r\ncontent-length: {}\r\n\r\n",
            body.len()
        )
        .into_bytes();
        query.extend(body);
        std::thread::spawn(move || {
            ask_all_the_time(server, &format!("query {map}"), &query, QUERY_INTERVAL);
        });
    }
    // Until there is nobody any more who wants to know.
    let _ = std::io::stdin().read_to_end(&mut Vec::new());
}

/// Asks at fixed times, one question after the other. What would have been asked while an answer did not come would
/// have waited for it, too: it counts as if it had been.
fn ask_all_the_time(server: SocketAddr, kind: &str, request: &[u8], interval: Duration) {
    let mut due = Instant::now();
    loop {
        sleep(due.saturating_duration_since(Instant::now()));
        let start = Instant::now();
        let outcome = answer(server, request).unwrap_or_else(|error| format!("{:?}", error.kind()));
        let mut took = start.elapsed();
        println!("{MARK} {} {outcome} {kind}", took.as_micros());
        while took > interval {
            took -= interval;
            println!("{MARK} {} {outcome} {kind}", took.as_micros());
        }
        due = (due + interval).max(Instant::now());
    }
}

fn answer(server: SocketAddr, request: &[u8]) -> std::io::Result<String> {
    let mut connection = TcpStream::connect_timeout(&server, PATIENCE)?;
    connection.set_nodelay(true)?;
    connection.set_read_timeout(Some(PATIENCE))?;
    connection.write_all(request)?;
    let mut answer = Vec::new();
    connection.read_to_end(&mut answer)?;
    let head = String::from_utf8_lossy(&answer[..answer.len().min(15)]).into_owned();
    Ok(head.strip_prefix("HTTP/1.1 ").map_or(head.clone(), |status| match status.get(..3) {
        Some("200") => "ok".to_owned(),
        status => status.unwrap_or("nothing").to_owned(),
    }))
}
