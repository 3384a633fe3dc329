//! Output of commands.

use std::fmt::Display;
use std::io;
use std::io::Write;

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::error::CliError;

/// Output of a command: results as lines of text or JSON on standard output, with a progress bar on standard error if
/// that is a terminal.
#[derive(Debug, Clone)]
pub struct Output {
    json: bool,
    bar: ProgressBar,
}

impl Output {
    /// Output for programs if `json`, for people otherwise.
    pub fn new(json: bool) -> Self {
        Self { json, bar: ProgressBar::hidden() }
    }

    /// Adds a progress bar of `steps` scans.
    pub fn with_bar(self, steps: usize) -> Self {
        self.with_bar_of(steps, "scans")
    }

    /// Adds a progress bar of `steps` items that are called `counted`.
    pub fn with_bar_of(self, steps: usize, counted: &str) -> Self {
        let bar = ProgressBar::new(steps as u64);
        let template = format!("{{bar:40}} {{pos}}/{{len}} {counted}, {{elapsed}} gone, {{eta}} to go");
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style);
        }
        Self { bar, ..self }
    }

    /// Adds a progress bar of a file of so many bytes.
    pub fn with_bar_of_bytes(self, bytes: u64) -> Self {
        let bar = ProgressBar::new(bytes);
        let template = "{bar:40} {bytes}/{total_bytes}, {elapsed} gone, {eta} to go";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self { bar, ..self }
    }

    /// Sets the bar to a place in the file.
    pub fn advance_to(&self, bytes: u64) {
        self.bar.set_position(bytes);
    }

    /// Adds a spinner with a message.
    pub fn with_spinner(self) -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
            bar.set_style(style);
        }
        Self { bar, ..self }
    }

    /// Sets the spinner's message.
    pub fn tell(&self, message: String) {
        self.bar.set_message(message);
        self.bar.tick();
    }

    /// Advances the bar by one step.
    pub fn step(&self) {
        self.bar.inc(1);
    }

    /// Removes the bar.
    pub fn clear_bar(&self) {
        self.bar.finish_and_clear();
    }

    /// True when results are printed as JSON.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Prints a result: as an object for programs, as text for people.
    pub fn print(&self, result: &(impl Serialize + Display)) -> Result<(), CliError> {
        if self.json { self.object(result) } else { self.line(result) }
    }

    /// Prints a line of text that is left out of JSON output.
    pub fn say(&self, text: impl Display) -> Result<(), CliError> {
        if self.json { Ok(()) } else { self.line(text) }
    }

    /// Prints a note on standard error.
    pub fn note(&self, text: impl Display) {
        self.bar.suspend(|| {
            let _ = writeln!(io::stderr(), "note: {text}");
        });
    }

    /// Prints a result as a JSON object.
    pub fn object(&self, result: &impl Serialize) -> Result<(), CliError> {
        self.line(serde_json::to_string(result).map_err(CliError::failed)?)
    }

    fn line(&self, text: impl Display) -> Result<(), CliError> {
        self.bar.suspend(|| writeln!(io::stdout(), "{text}")).map_err(CliError::printing)
    }
}
