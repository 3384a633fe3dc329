//! What was asked, how it was answered, and after how long.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Of so many requests one succeeds at least: fewer may all have come while the disk hung.
const ANSWERS_MIN: usize = 20;

/// Of all kinds of requests.
#[derive(Default)]
pub(crate) struct Report(Mutex<BTreeMap<String, Kind>>);

#[derive(Default)]
struct Kind {
    /// Of the answers, in milliseconds.
    times_ms: Vec<f64>,
    /// By the word of the refusal; `ok` where there was none.
    outcomes: BTreeMap<String, usize>,
    bound: Bound,
}

/// How long the answers of a kind may take.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) enum Bound {
    /// As long as the disk.
    #[default]
    None,
    /// Hardly: neither `/livez` nor a query waits for a disk.
    Answer,
    /// The call's deadline.
    Deadline(Duration),
}

impl Report {
    pub(crate) fn note(&self, kind: &str, bound: Bound, took: Duration, outcome: &str) {
        let mut kinds = self.kinds();
        let kind = kinds.entry(kind.to_owned()).or_default();
        kind.bound = bound;
        kind.times_ms.push(took.as_secs_f64() * 1e3);
        *kind.outcomes.entry(outcome.to_owned()).or_default() += 1;
    }

    /// Answers so far.
    pub(crate) fn answers(&self) -> usize {
        self.kinds().values().map(|kind| kind.times_ms.len()).sum()
    }

    /// In CI, too: what must not wait does not, and nothing outlives its deadline.
    pub(crate) fn assert_answered(&self, answer_max: Duration, late_max: Duration) {
        let kinds = self.kinds();
        let mut broken = Vec::new();
        for (name, kind) in kinds.iter() {
            let most = match kind.bound {
                Bound::None => Duration::MAX,
                Bound::Answer => answer_max,
                Bound::Deadline(deadline) => deadline + late_max,
            };
            let late = kind.times_ms.iter().filter(|&&ms| ms > most.as_secs_f64() * 1e3).count();
            if late > 0 {
                broken
                    .push(format!("{late} of {name} took more than {most:?}: worst {:.0} ms", kind.worst()));
            }
            if kind.bound == Bound::Answer && kind.outcomes.keys().any(|outcome| outcome != "ok") {
                broken.push(format!("{name} was refused: {:?}", kind.outcomes));
            }
            if kind.times_ms.len() >= ANSWERS_MIN && !kind.outcomes.contains_key("ok") {
                broken.push(format!("{name} never succeeded: {:?}", kind.outcomes));
            }
        }
        assert!(broken.is_empty(), "{}", broken.join("\n"));
    }

    /// In the long form.
    pub(crate) fn assert_percentiles(&self, livez_max: Duration, query_max: Duration) {
        for (name, kind) in self.kinds().iter() {
            let most = match name.split_whitespace().next() {
                Some("probe:/livez") => livez_max,
                Some("probe:query") => query_max,
                _ => continue,
            };
            let p999 = kind.part(0.999);
            assert!(p999 <= most.as_secs_f64() * 1e3, "{name}: p99.9 is {p999:.1} ms, {most:?} is the bound");
        }
    }

    fn kinds(&self) -> MutexGuard<'_, BTreeMap<String, Kind>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kind {
    fn worst(&self) -> f64 {
        self.part(1.0)
    }

    /// The time that this part of the answers took at most, milliseconds.
    fn part(&self, part: f64) -> f64 {
        let mut times_ms = self.times_ms.clone();
        times_ms.sort_unstable_by(f64::total_cmp);
        let place = (times_ms.len() as f64 * part).ceil() as usize;
        times_ms.get(place.saturating_sub(1)).copied().unwrap_or_default()
    }
}

impl Display for Report {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (name, kind) in self.kinds().iter() {
            let [p50, p99, p999, worst] = [0.5, 0.99, 0.999, 1.0].map(|part| kind.part(part));
            let (count, outcomes) = (kind.times_ms.len(), &kind.outcomes);
            writeln!(
                f,
                "{name:24} {count:7} answers; ms p50 {p50:.1} p99 {p99:.1} p99.9 {p999:.1} max {worst:.1}; {outcomes:?}"
            )?;
        }
        Ok(())
    }
}
