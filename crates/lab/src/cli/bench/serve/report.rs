//! Results of the load.

use std::fmt::{self, Display};

use clap::ValueEnum;
use serde::Serialize;

use super::protocol::Protocol;
use crate::fleet::Answered;
use mrol::console::map_report::{count, percent};

/// The result of one protocol and one size of messages.
#[derive(Serialize)]
pub(super) struct Line {
    protocol: String,
    points_per_message: usize,
    messages: u64,
    points_per_s: f64,
    p50_us: f64,
    p99_us: f64,
    share_occupied: f64,
}

impl Line {
    pub(super) const HEAD: &str =
        "protocol     points a message    messages  M points/s     p50 us     p99 us  occupied";

    pub(super) fn of(protocol: Protocol, points_per_message: usize, answered: &Answered) -> Self {
        let us = |quantile| answered.latencies.value_at_quantile(quantile) as f64 / 1e3;
        let name = protocol.to_possible_value().map(|value| value.get_name().to_owned());
        Self {
            protocol: name.unwrap_or_default(),
            points_per_message,
            messages: answered.latencies.len(),
            points_per_s: answered.points as f64 / answered.seconds,
            p50_us: us(0.5),
            p99_us: us(0.99),
            share_occupied: answered.occupied as f64 / answered.points.max(1) as f64,
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<12} {:>16} {:>11} {:>11.1} {:>10.0} {:>10.0} {:>9}",
            self.protocol,
            count(self.points_per_message),
            count(self.messages as usize),
            self.points_per_s / 1e6,
            self.p50_us,
            self.p99_us,
            percent(self.share_occupied)
        )
    }
}
