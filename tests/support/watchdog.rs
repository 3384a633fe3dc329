//! Ends a test in which nothing moves any more, and says where the threads stand: a test that hangs says nothing.

use std::fmt::Write;
use std::fs;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

const LOOKS: Duration = Duration::from_millis(100);
/// A test that a watchdog ends fails as one that panics.
const FAILED: i32 = 101;

/// A thread that expects something to happen every now and then, while this lives.
pub struct Watchdog {
    beats: Arc<AtomicU64>,
    enough: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// Says that something happened.
#[derive(Clone)]
pub struct Beat(Arc<AtomicU64>);

impl Beat {
    pub fn beat(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

impl Watchdog {
    /// Ends this process once nothing has happened for `patience`, and says what the threads of `process` do then.
    pub fn begin(process: u32, patience: Duration) -> Self {
        let (beats, enough) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
        let (counted, told) = (Arc::clone(&beats), Arc::clone(&enough));
        let thread = std::thread::spawn(move || {
            let (mut seen, mut since) = (0, Instant::now());
            while !told.load(Ordering::Relaxed) {
                let now = counted.load(Ordering::Relaxed);
                if now != seen {
                    (seen, since) = (now, Instant::now());
                }
                if since.elapsed() > patience {
                    eprintln!("nothing has moved for {patience:?}, after {seen} beats");
                    eprintln!("{}", threads_of(process));
                    end(process);
                }
                fail_on_deadlock();
                sleep(LOOKS);
            }
        });
        Self { beats, enough, thread: Some(thread) }
    }

    /// For whoever makes something happen.
    pub fn heart(&self) -> Beat {
        Beat(Arc::clone(&self.beats))
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        self.enough.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Ends this process where its threads wait for each other in a circle.
#[cfg(feature = "deadlock_detection")]
fn fail_on_deadlock() {
    let circles = parking_lot::deadlock::check_deadlock();
    for (i, circle) in circles.iter().enumerate() {
        for thread in circle {
            eprintln!("deadlock {i}: {:?}\n{:?}", thread.thread_id(), thread.backtrace());
        }
    }
    if !circles.is_empty() {
        end(std::process::id());
    }
}

#[cfg(not(feature = "deadlock_detection"))]
fn fail_on_deadlock() {}

/// Ends this process, and the one that was watched: nothing else would end that.
fn end(watched: u32) -> ! {
    if watched != std::process::id() {
        let _ = Command::new("kill").args(["-s", "KILL", &watched.to_string()]).status();
    }
    std::process::exit(FAILED)
}

/// Where the threads of a process stand: by a debugger where there is one, else as the system tells.
pub fn threads_of(process: u32) -> String {
    by_debugger(process).unwrap_or_else(|| by_system(process))
}

fn by_debugger(process: u32) -> Option<String> {
    // Into a file: whoever is debugged stands still, and this process may be the one, so that it reads no pipe.
    let file = tempfile::NamedTempFile::new().ok()?;
    let mut debugger = Command::new("gdb");
    debugger.args(["-p", &process.to_string(), "-batch", "-ex", "thread apply all bt 25"]);
    debugger.stdin(Stdio::null()).stdout(file.reopen().ok()?).stderr(Stdio::null()).status().ok()?;
    let text = String::from_utf8_lossy(&fs::read(file.path()).ok()?).into_owned();
    text.contains("Thread ").then_some(text)
}

fn by_system(process: u32) -> String {
    let mut text = String::new();
    for thread in fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten() {
        let read = |name: &str| fs::read_to_string(thread.path().join(name)).unwrap_or_default();
        let (name, waits, stack) = (read("comm"), read("wchan"), read("stack"));
        let _ = writeln!(text, "{}: waits in {waits:?}\n{stack}", name.trim());
    }
    text
}
