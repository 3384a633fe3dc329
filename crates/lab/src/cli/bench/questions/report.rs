//! Results of questions.

use std::fmt::{self, Display};

use serde::Serialize;

use crate::fleet::questions::Told;
use mrol::console::map_report::{count, percent};

/// The result of one kind of questions.
#[derive(Serialize)]
pub(super) struct Line {
    what: &'static str,
    messages: u64,
    items_per_message: usize,
    items_per_s: f64,
    p50_ms: f64,
    p99_ms: f64,
    /// Processor time of the server, of one core.
    server: f64,
}

impl Line {
    pub(super) const HEAD: &str =
        "what                    messages  of items   M items/s    p50 ms    p99 ms    server";

    pub(super) fn of(what: &'static str, told: &Told) -> Self {
        let ms = |quantile| told.latencies.value_at_quantile(quantile) as f64 / 1e6;
        let messages = told.latencies.len();
        Self {
            what,
            messages,
            items_per_message: told.items / messages.max(1) as usize,
            items_per_s: told.items as f64 / told.seconds.max(1e-9),
            p50_ms: ms(0.5),
            p99_ms: ms(0.99),
            server: told.server_cpu_s / told.seconds.max(1e-9),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<22} {:>9} {:>9} {:>11.3} {:>9.3} {:>9.3} {:>9}",
            self.what,
            count(self.messages as usize),
            count(self.items_per_message),
            self.items_per_s / 1e6,
            self.p50_ms,
            self.p99_ms,
            percent(self.server)
        )
    }
}
