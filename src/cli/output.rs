//! What a command prints.

use std::fmt::Display;
use std::io::{self, Write};

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::error::CliError;

/// Where results go: lines of text, or of JSON, on standard output; a bar below them on a terminal.
#[derive(Debug, Clone)]
pub(super) struct Output {
    json: bool,
    bar: ProgressBar,
}

impl Output {
    pub(super) fn new(json: bool) -> Self {
        Self { json, bar: ProgressBar::hidden() }
    }

    /// This output, with a bar of `steps` scans on standard error, if that is a terminal.
    pub(super) fn with_bar(self, steps: usize) -> Self {
        self.with_bar_of(steps, "scans")
    }

    /// This output, with a bar of `steps` of what is counted.
    pub(super) fn with_bar_of(self, steps: usize, counted: &str) -> Self {
        let bar = ProgressBar::new(steps as u64);
        let template = format!("{{bar:40}} {{pos}}/{{len}} {counted}, {{elapsed}} gone, {{eta}} to go");
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style);
        }
        Self { bar, ..self }
    }

    /// This output, with a line on standard error that says what goes on, if that is a terminal.
    pub(super) fn with_spinner(self) -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
            bar.set_style(style);
        }
        Self { bar, ..self }
    }

    /// Says what goes on now.
    pub(super) fn tell(&self, message: String) {
        self.bar.set_message(message);
        self.bar.tick();
    }

    /// One step of the bar is done.
    pub(super) fn step(&self) {
        self.bar.inc(1);
    }

    /// The bar has done its duty.
    pub(super) fn clear_bar(&self) {
        self.bar.finish_and_clear();
    }

    /// True when programs read the output.
    pub(super) fn is_json(&self) -> bool {
        self.json
    }

    /// Prints a result: its object for programs, its text for people.
    pub(super) fn print(&self, result: &(impl Serialize + Display)) -> Result<(), CliError> {
        if self.json { self.object(result) } else { self.line(result) }
    }

    /// Prints something that only people want to read.
    pub(super) fn say(&self, text: impl Display) -> Result<(), CliError> {
        if self.json { Ok(()) } else { self.line(text) }
    }

    /// Says something beside the results, on standard error.
    pub(super) fn note(&self, text: impl Display) {
        self.bar.suspend(|| {
            let _ = writeln!(io::stderr(), "note: {text}");
        });
    }

    /// Prints an object for programs.
    pub(super) fn object(&self, result: &impl Serialize) -> Result<(), CliError> {
        self.line(serde_json::to_string(result).map_err(CliError::failed)?)
    }

    fn line(&self, text: impl Display) -> Result<(), CliError> {
        self.bar.suspend(|| writeln!(io::stdout(), "{text}")).map_err(CliError::printing)
    }
}
