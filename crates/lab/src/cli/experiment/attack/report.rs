//! What callers waited for, and what became of the attacks.

use std::fmt::{self, Display};
use std::path::Path;

use serde::Serialize;

use crate::fleet::Tally;
use crate::fleet::attack::Damage;
use crate::report::{ReportError, Table, folder};
use mrol::console::map_report::count;

/// What the callers are called, in the order of their tallies, and how often each asks, times a second.
pub(super) const CALLERS: [(&str, f64); 6] = [
    ("robot: scans", 10.0),
    ("planner: queries", 10.0),
    ("operator: describe", 5.0),
    ("operator: snapshot", 1.0 / 60.0),
    ("operator: /readyz", 5.0),
    ("/livez", 20.0),
];

/// What is to be met.
#[derive(Debug, clap::Args)]
pub(super) struct Goals {
    /// Largest p99 of an honest caller beside the attack, as a multiple of what it is alone
    #[arg(long, value_name = "N", default_value_t = 5.0)]
    times_max: f64,
    /// Largest p99 of an honest caller beside the attack, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0)]
    p99_max_s: f64,
    /// Largest p99.9 of /livez beside the attack, milliseconds
    #[arg(long, value_name = "MS", default_value_t = 100.0)]
    livez_max_ms: f64,
}

/// How long a caller waited, milliseconds.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Waited {
    requests: u64,
    /// Requests that were due, and not made since one before them had no answer.
    left_out: u64,
    errors: u64,
    p50_ms: f64,
    p95_ms: f64,
    p99_ms: f64,
    p999_ms: f64,
    max_ms: f64,
}

/// What one honest caller waited for, alone and attacked.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Line {
    caller: &'static str,
    alone: Waited,
    attacked: Waited,
    /// How many times as long the p99 is.
    times_p99: f64,
}

impl Waited {
    fn of(tally: &Tally, due: f64) -> Self {
        Self {
            requests: tally.operations(),
            left_out: (due as u64).saturating_sub(tally.operations()),
            errors: tally.error_count(),
            p50_ms: tally.quantile_ms(0.5),
            p95_ms: tally.quantile_ms(0.95),
            p99_ms: tally.quantile_ms(0.99),
            p999_ms: tally.quantile_ms(0.999),
            max_ms: tally.quantile_ms(1.0),
        }
    }

    fn cells(&self) -> [String; 8] {
        let ms = |ms: f64| format!("{ms:.2}");
        let Self { requests, left_out, errors, p50_ms, p95_ms, p99_ms, p999_ms, max_ms } = *self;
        [
            requests.to_string(),
            left_out.to_string(),
            errors.to_string(),
            ms(p50_ms),
            ms(p95_ms),
            ms(p99_ms),
            ms(p999_ms),
            ms(max_ms),
        ]
    }
}

impl Line {
    pub(super) const HEAD: &str = "\
caller                          alone: p50      p95      p99      max   attacked: p50      p95      p99    p99.9      max   p99 x  left out   errors";

    /// A line for each caller, of tallies and how long they took, seconds.
    pub(super) fn all(
        (alone, alone_s): (&[Tally], f64),
        (attacked, attacked_s): (&[Tally], f64),
    ) -> Vec<Self> {
        let line = |((caller, per_s), (alone, attacked)): ((&'static str, f64), (&Tally, &Tally))| {
            let (alone, attacked) =
                (Waited::of(alone, per_s * alone_s), Waited::of(attacked, per_s * attacked_s));
            Self { caller, alone, attacked, times_p99: attacked.p99_ms / alone.p99_ms }
        };
        CALLERS.into_iter().zip(alone.iter().zip(attacked)).map(line).collect()
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { caller, alone, attacked, times_p99 } = self;
        let Waited { p50_ms, p95_ms, p99_ms, max_ms, .. } = alone;
        write!(f, "{caller:<28} {p50_ms:>13.1} {p95_ms:>8.1} {p99_ms:>8.1} {max_ms:>8.1}")?;
        let Waited { p50_ms, p95_ms, p99_ms, p999_ms, max_ms, left_out, errors, .. } = attacked;
        write!(
            f,
            " {p50_ms:>15.1} {p95_ms:>8.1} {p99_ms:>8.1} {p999_ms:>8.1} {max_ms:>8.1} {times_p99:>7.1} {left_out:>9} {errors:>8}"
        )
    }
}

impl Damage {
    pub(super) const HEAD: &str = "attack            answered    refused   p50 ms  most frequent error";
}

impl Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { attack, answered, refused, p50_ms, error } = self;
        let (answered, refused) = (count(*answered as usize), count(*refused as usize));
        let error = error.as_deref().unwrap_or_default();
        write!(f, "{:<16} {answered:>9} {refused:>10} {p50_ms:>8.1}  {error}", attack.name())
    }
}

impl Goals {
    /// Description of the goals that were missed, if any were.
    pub(super) fn complaint(&self, lines: &[Line]) -> Option<String> {
        let missed: Vec<String> = lines.iter().filter_map(|line| self.missed(line)).collect();
        (!missed.is_empty()).then(|| missed.join("; "))
    }

    fn missed(&self, Line { caller, attacked, times_p99, .. }: &Line) -> Option<String> {
        let Waited { p99_ms, p999_ms, errors, .. } = *attacked;
        if *caller == CALLERS[CALLERS.len() - 1].0 && p999_ms > self.livez_max_ms {
            Some(format!("{caller}: p99.9 is {p999_ms:.0} ms, and --livez-max-ms {}", self.livez_max_ms))
        } else if p99_ms > self.p99_max_s * 1e3 {
            Some(format!("{caller}: p99 is {p99_ms:.0} ms, and --p99-max-s {}", self.p99_max_s))
        } else if *times_p99 > self.times_max {
            Some(format!("{caller}: p99 is {times_p99:.1} times as long, and --times-max {}", self.times_max))
        } else if errors > 0 {
            Some(format!("{caller}: {errors} requests failed"))
        } else {
            None
        }
    }
}

/// Writes `attack.csv` with the callers, and `attack.md` with callers and attacks.
pub(super) fn write(lines: &[Line], damages: &[Damage], out: &Path) -> Result<(), ReportError> {
    folder(out)?;
    let head = [
        "caller", "phase", "requests", "left_out", "errors", "p50_ms", "p95_ms", "p99_ms", "p999_ms",
        "max_ms",
    ];
    let mut callers = Table::new(head);
    for Line { caller, alone, attacked, .. } in lines {
        for (phase, waited) in [("alone", alone), ("attacked", attacked)] {
            callers.push([(*caller).to_owned(), phase.to_owned()].into_iter().chain(waited.cells()));
        }
    }
    callers.write_csv(&out.join("attack.csv"))?;
    callers.write_markdown(&out.join("attack.md"))?;
    let mut attacks = Table::new(["attack", "answered", "refused", "p50_ms"]);
    for Damage { attack, answered, refused, p50_ms, .. } in damages {
        attacks.push([attack.name(), answered.to_string(), refused.to_string(), format!("{p50_ms:.1}")]);
    }
    attacks.write_csv(&out.join("attackers.csv"))
}
