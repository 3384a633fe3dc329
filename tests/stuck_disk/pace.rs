//! How fast the load asks: so that the cores are busy as much as is wanted.

use std::fs;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Of all cores, in the long form.
const BUSY: f64 = 0.7;
const LOOKS: Duration = Duration::from_secs(1);
const PAUSE_MIN_US: u64 = 50;
const PAUSE_MAX_US: u64 = 1_000_000;
/// In the short form: on a busy machine it must not be the load that one waits for.
const PAUSE_US: u64 = 50_000;
/// From 60 % busy to 80 % busy the pause doubles.
const STEP: f64 = 5.0;

/// The pause after each request of the load.
pub(crate) struct Pace {
    pause_us: Arc<AtomicU64>,
    enough: Arc<AtomicBool>,
    governor: Option<JoinHandle<()>>,
}

impl Pace {
    /// A fixed pause, or one that makes the machine as busy as wanted.
    pub(crate) fn begin(is_governed: bool) -> Self {
        let pause_us = Arc::new(AtomicU64::new(PAUSE_US));
        let enough = Arc::new(AtomicBool::new(false));
        let (set, told) = (Arc::clone(&pause_us), Arc::clone(&enough));
        let governor = is_governed.then(|| std::thread::spawn(move || govern(&set, &told)));
        Self { pause_us, enough, governor }
    }

    pub(crate) async fn pause(&self) {
        let pause = Duration::from_micros(self.pause_us.load(Ordering::Relaxed));
        tokio::time::sleep(pause).await;
    }
}

impl Drop for Pace {
    fn drop(&mut self) {
        self.enough.store(true, Ordering::Relaxed);
        let _ = self.governor.take().map(JoinHandle::join);
    }
}

fn govern(pause_us: &AtomicU64, enough: &AtomicBool) {
    let (mut before, mut shares) = (ticks(), Vec::new());
    while !enough.load(Ordering::Relaxed) {
        std::thread::sleep(LOOKS);
        let now = ticks();
        let share = (now.0 - before.0) as f64 / (now.1 - before.1).max(1) as f64;
        before = now;
        shares.push(share);
        let pause = pause_us.load(Ordering::Relaxed) as f64 * 2f64.powf((share - BUSY) * STEP);
        pause_us.store((pause as u64).clamp(PAUSE_MIN_US, PAUSE_MAX_US), Ordering::Relaxed);
    }
    println!(
        "the cores were busy for {:.0} %",
        100.0 * shares.iter().sum::<f64>() / shares.len().max(1) as f64
    );
}

/// Of all cores since the start of the machine: busy, and in all.
fn ticks() -> (u64, u64) {
    let stat = fs::read_to_string("/proc/stat").unwrap();
    let first = stat.lines().next().unwrap();
    let ticks: Vec<u64> =
        first.split_whitespace().skip(1).take(8).map(|text| text.parse().unwrap()).collect();
    let all: u64 = ticks.iter().sum();
    // Idle, and idle while a disk works.
    (all - ticks[3] - ticks[4], all)
}
