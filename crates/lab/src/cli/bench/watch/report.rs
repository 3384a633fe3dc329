//! Results of `mrol-lab bench watch`.

use std::fmt::{self, Display};
use std::time::Duration;

use serde::Serialize;

use crate::fleet::Tally;
use mrol::console::map_report::{bytes, count};

/// What was read off the processes at the end of a stage.
pub(super) struct Measured {
    /// From the last scan until all replicas had what was acknowledged.
    pub(super) behind: Duration,
    /// Processor time of the server a second; none where it was not one server all the time.
    pub(super) server_cpu: Option<f64>,
    /// Resident memory of the server.
    pub(super) resident_bytes: u64,
    /// How often each replica was copied so far.
    pub(super) resets: Vec<u64>,
}

/// The result of a stage.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Line {
    stage: &'static str,
    /// Scans that were due, and those of them that failed.
    scans: u64,
    failed: u64,
    scan_p50_ms: f64,
    scan_p99_ms: f64,
    hashes_compared: u64,
    hashes_differing: u64,
    lag_p50_ms: f64,
    lag_p99_ms: f64,
    behind_ms: f64,
    server_cpu: Option<f64>,
    resident_bytes: u64,
    /// Least and most copies of a replica so far, the first one among them.
    copies_min: u64,
    copies_max: u64,
}

impl Line {
    pub(super) const HEAD: &str = "stage              scans failed  p50 ms  p99 ms   compared differ   lag p50     p99  server cpu      memory  \
                                   copies";

    pub(super) fn of(stage: &'static str, scans: &Tally, seen: &Tally, measured: Measured) -> Self {
        let Measured { behind, server_cpu, resident_bytes, resets } = measured;
        Self {
            stage,
            scans: scans.operations(),
            failed: scans.error_count(),
            scan_p50_ms: scans.quantile_ms(0.5),
            scan_p99_ms: scans.quantile_ms(0.99),
            hashes_compared: seen.operations(),
            hashes_differing: seen.error_count(),
            lag_p50_ms: seen.quantile_ms(0.5),
            lag_p99_ms: seen.quantile_ms(0.99),
            behind_ms: behind.as_secs_f64() * 1e3,
            server_cpu,
            resident_bytes,
            copies_min: resets.iter().copied().min().unwrap_or_default(),
            copies_max: resets.iter().copied().max().unwrap_or_default(),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cpu = self.server_cpu.map_or_else(String::new, |cpu| format!("{:.1} %", 100.0 * cpu));
        write!(
            f,
            "{:<18} {:>5} {:>6} {:>7.2} {:>7.1} {:>10} {:>6} {:>9.2} {:>7.1} {cpu:>11} {:>11} {:>7}",
            self.stage,
            self.scans,
            self.failed,
            self.scan_p50_ms,
            self.scan_p99_ms,
            count(self.hashes_compared as usize),
            self.hashes_differing,
            self.lag_p50_ms,
            self.lag_p99_ms,
            bytes(self.resident_bytes as usize),
            match (self.copies_min, self.copies_max) {
                (min, max) if min == max => max.to_string(),
                (min, max) => format!("{min}-{max}"),
            }
        )
    }
}

/// The result of all stages.
#[derive(Serialize)]
pub(super) struct Verdict {
    watchers: u16,
    hashes_compared: u64,
    hashes_differing: u64,
    /// Processor time of the server a second and watcher, of one core.
    cpu_per_watcher: f64,
    /// Memory of the server with replicas against without; with one more that reads nothing against without that one.
    memory_of_watching: f64,
    memory_of_stalled: f64,
    /// Lag of replicas beside one that reads nothing against without that one, 99 of 100; and the time of a scan, half
    /// of them.
    lag_of_stalled: f64,
    scan_of_stalled: f64,
    /// Copies of all replicas that a restart of the server made, and that a journal made which is too short.
    copies_by_restart: bool,
    copies_by_short_journal: bool,
}

impl Verdict {
    pub(super) fn of(watchers: u16, stages: [Line; 5]) -> Self {
        let [alone, watched, stalled, killed, away] = &stages;
        let cpu = |line: &Line| line.server_cpu.unwrap_or_default();
        let memory = |line: &Line, of: &Line| line.resident_bytes as f64 / of.resident_bytes.max(1) as f64;
        Self {
            watchers,
            hashes_compared: stages.iter().map(|line| line.hashes_compared).sum(),
            hashes_differing: stages.iter().map(|line| line.hashes_differing).sum(),
            cpu_per_watcher: (cpu(watched) - cpu(alone)) / f64::from(watchers),
            memory_of_watching: memory(watched, alone),
            memory_of_stalled: memory(stalled, watched),
            lag_of_stalled: stalled.lag_p99_ms / watched.lag_p99_ms,
            scan_of_stalled: stalled.scan_p50_ms / watched.scan_p50_ms,
            copies_by_restart: killed.copies_max > 1,
            copies_by_short_journal: (away.copies_min, away.copies_max) == (2, 2),
        }
    }

    /// What is not as it has to be.
    pub(super) fn complaint(&self) -> Option<String> {
        let differing = self.hashes_differing;
        let complaint = match () {
            () if differing > 0 => format!("{differing} hashes of replicas differ from the map's"),
            () if self.hashes_compared == 0 => "no hash was compared".into(),
            () if self.copies_by_restart => {
                "a replica was copied anew before the journal was too short".into()
            }
            () if !self.copies_by_short_journal => "not every replica was copied anew once".into(),
            () => return None,
        };
        Some(complaint)
    }
}

impl Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} hashes compared, {} differ; a watcher costs {:.2} % of a core; memory {:.3} times with {} watchers, and \
             {:.3} times that with one that reads nothing, lag {:.2} times, scans {:.2} times",
            count(self.hashes_compared as usize),
            self.hashes_differing,
            100.0 * self.cpu_per_watcher,
            self.memory_of_watching,
            self.watchers,
            self.memory_of_stalled,
            self.lag_of_stalled,
            self.scan_of_stalled
        )
    }
}
