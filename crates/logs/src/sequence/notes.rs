//! What is said of a log once, however often it is met.

use std::collections::BTreeMap;

/// What is said of a log once, however often it is met.
#[derive(Debug, Clone, Default)]
pub(super) struct Notes {
    /// By the kind: the first text, and how often it was met.
    met: BTreeMap<&'static str, (String, u64)>,
    unsaid: Vec<String>,
}

impl Notes {
    /// Notes something of a kind, in words that are used the first time.
    pub(super) fn note(&mut self, kind: &'static str, text: impl FnOnce() -> String) {
        let (_, times) = self.met.entry(kind).or_insert_with(|| {
            let text = text();
            self.unsaid.push(text.clone());
            (text, 0)
        });
        *times += 1;
    }

    /// What was not said yet.
    pub(super) fn take(&mut self) -> Vec<String> {
        std::mem::take(&mut self.unsaid)
    }

    /// How often each was met, of those that were met more than once.
    pub(super) fn totals(&self) -> Vec<String> {
        let often = self.met.values().filter(|(_, times)| *times > 1);
        often.map(|(text, times)| format!("{times} times in all: {text}")).collect()
    }
}
