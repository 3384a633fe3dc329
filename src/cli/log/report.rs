//! Output of `mrol log`.

use std::fmt::{self, Display, Formatter};

use serde::Serialize;

use mrol::console::count;
use mrol_logs::survey::TopicSummary;

/// Characters of a column, at most.
const WIDTH_MAX: usize = 60;

/// Widths of the columns of topics and of types.
pub(super) fn topic_widths(topics: &[TopicSummary]) -> (usize, usize) {
    let longest = |text: fn(&TopicSummary) -> &str, least: &str| {
        let widths = topics.iter().map(|summary| text(summary).chars().count());
        widths.max().unwrap_or(0).clamp(least.len(), WIDTH_MAX)
    };
    (longest(|summary| &summary.topic.name, "topic"), longest(|summary| &summary.topic.type_name, "type"))
}

/// The line of a topic.
#[derive(Serialize)]
pub(super) struct TopicLine<'a> {
    topic: &'a str,
    #[serde(rename = "type")]
    type_name: &'a str,
    encoding: &'a str,
    messages: u64,
    bytes: u64,
    rate_hz: Option<f64>,
    frame: Option<&'a str>,
    unreadable: Option<&'a str>,
    #[serde(skip)]
    widths: (usize, usize),
}

impl<'a> TopicLine<'a> {
    pub(super) fn of(summary: &'a TopicSummary, widths: (usize, usize)) -> Self {
        Self {
            topic: &summary.topic.name,
            type_name: &summary.topic.type_name,
            encoding: &summary.topic.encoding,
            messages: summary.messages,
            bytes: summary.bytes,
            rate_hz: summary.rate_hz(),
            frame: summary.frame.as_deref(),
            unreadable: summary.unreadable.as_deref(),
            widths,
        }
    }

    /// The line above those of the topics.
    pub(super) fn head((topic, type_name): (usize, usize)) -> String {
        format!("{:<topic$}  {:<type_name$}    messages      hertz  frame", "topic", "type")
    }
}

impl Display for TopicLine<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (topic, type_name) = self.widths;
        let rate = self.rate_hz.map(|rate_hz| format!("{rate_hz:.1}")).unwrap_or_default();
        let messages = count(self.messages as usize);
        write!(
            f,
            "{:<topic$}  {:<type_name$}  {messages:>10}  {rate:>9}  {}",
            self.topic,
            self.type_name,
            self.frame.unwrap_or_default()
        )?;
        if self.encoding != "cdr" {
            write!(f, "  in {:?}, and cdr is read", self.encoding)?;
        }
        self.unreadable.map_or(Ok(()), |why| write!(f, "  cannot be read: {why}"))
    }
}

/// The line of what would be used.
#[derive(Serialize)]
pub(super) struct UseLine {
    pub(super) used_for: &'static str,
    pub(super) source: String,
    pub(super) why: String,
}

impl Display for UseLine {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{:<9} {}: {}", self.used_for, self.source, self.why)
    }
}

/// The line of what is missing.
#[derive(Serialize)]
pub(super) struct MissingLine {
    pub(super) missing: String,
}

impl Display for MissingLine {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "missing   {}", self.missing)
    }
}

/// The line of a log that ends too early.
#[derive(Serialize)]
pub(super) struct DamageLine {
    pub(super) damaged: String,
}

impl Display for DamageLine {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "damaged   {}", self.damaged)
    }
}
