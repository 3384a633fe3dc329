//! Reports during a soak and at its end.

use std::fmt::{self, Display};

use serde::Serialize;

use crate::fleet::{Tally, Trend};
use mrol::console::map_report::{bytes, count};

/// Statistics of the operations of one kind.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Done {
    operations: u64,
    per_s: f64,
    p50_ms: f64,
    p99_ms: f64,
    max_ms: f64,
    errors: u64,
}

impl Done {
    /// The statistics of `tally`, over `seconds`.
    pub(super) fn of(tally: &Tally, seconds: f64) -> Self {
        Self {
            operations: tally.operations(),
            per_s: tally.operations() as f64 / seconds,
            p50_ms: tally.quantile_ms(0.5),
            p99_ms: tally.quantile_ms(0.99),
            max_ms: tally.quantile_ms(1.0),
            errors: tally.error_count(),
        }
    }
}

impl Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { per_s, p50_ms, p99_ms, .. } = self;
        write!(f, "{per_s:>8.0} {p50_ms:>8.2} {p99_ms:>8.1}")
    }
}

/// The report of an interval.
#[derive(Serialize)]
pub(super) struct Line {
    pub(super) seconds: f64,
    pub(super) queries: Done,
    pub(super) changes: Done,
    pub(super) resident_bytes: u64,
}

impl Line {
    pub(super) const HEAD: &str =
        "  seconds queries/s   p50 ms   p99 ms changes/s   p50 ms   p99 ms    errors      memory";
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seconds, queries, changes, resident_bytes } = self;
        let (errors, memory) = (queries.errors + changes.errors, bytes(*resident_bytes as usize));
        write!(f, "{seconds:>9.0}  {queries}  {changes} {:>9} {memory:>11}", count(errors as usize))
    }
}

/// The result of the soak.
#[derive(Serialize)]
pub(super) struct Verdict {
    seconds: f64,
    load: f64,
    /// Share of the due operations that were not done in time.
    left: f64,
    queries: Done,
    changes: Done,
    /// Mean resident memory over the second half, bytes.
    mean_resident_bytes: f64,
    /// Growth of resident memory by the line through the measurements of the second half, bytes an hour.
    growth_bytes_per_hour: f64,
    growth_of_second_half: f64,
}

impl Verdict {
    /// The report of `seconds` at a load that meant `due` operations a second.
    pub(super) fn of(
        seconds: f64,
        load: f64,
        due: f64,
        [queries, changes]: [Done; 2],
        memory: Trend,
    ) -> Self {
        Self {
            seconds,
            load,
            left: 1.0 - (queries.per_s + changes.per_s) / due,
            queries,
            changes,
            mean_resident_bytes: memory.mean,
            growth_bytes_per_hour: memory.slope * 3600.0,
            growth_of_second_half: memory.slope * seconds / 2.0 / memory.mean,
        }
    }

    /// Description of what is wrong, if anything.
    pub(super) fn complaint(&self, growth_max: f64, left_max: f64) -> Option<String> {
        let errors = self.queries.errors + self.changes.errors;
        if errors > 0 {
            Some(format!("{errors} operations failed"))
        } else if self.left > left_max {
            Some(format!("the load was too much: {:.1} % of it was not carried out", self.left * 100.0))
        } else if self.growth_of_second_half > growth_max {
            Some(format!("memory grew by more than {} % in the second half", growth_max * 100.0))
        } else {
            None
        }
    }
}

impl Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seconds, load, left, queries, changes, .. } = self;
        writeln!(
            f,
            "\n{seconds:.0} s at {:.0} % of the capacity, {:.2} % of it not carried out",
            load * 100.0,
            left * 100.0
        )?;
        for (name, done) in [("queries", queries), ("changes", changes)] {
            writeln!(
                f,
                "{name}: {}, {} errors, p50 {:.2} ms, p99 {:.1} ms, longest {:.0} ms",
                count(done.operations as usize),
                count(done.errors as usize),
                done.p50_ms,
                done.p99_ms,
                done.max_ms
            )?;
        }
        write!(
            f,
            "memory over the second half: {} on average, {:+.1} MiB an hour, {:+.2} % in that time",
            bytes(self.mean_resident_bytes as usize),
            self.growth_bytes_per_hour / f64::from(1 << 20),
            self.growth_of_second_half * 100.0,
        )
    }
}
