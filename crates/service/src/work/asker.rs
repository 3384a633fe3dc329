//! Whom a request counts for, where callers take turns.

use std::fmt::{Display, Formatter, Result as FmtResult};
use std::sync::Arc;

/// Whom a request counts for: a key, or the place that it came from where there is none. By default that of what the
/// process does itself.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Asker(Arc<str>);

impl Asker {
    /// The holder of the key of this name.
    pub fn with_key(name: &str) -> Self {
        Self(format!("key {name}").into())
    }

    /// Somebody without a key, at this place.
    pub fn at(place: impl Display) -> Self {
        Self(place.to_string().into())
    }

    /// What it is called in refusals.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for Asker {
    fn default() -> Self {
        Self::at("somebody")
    }
}

impl Display for Asker {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        f.write_str(&self.0)
    }
}
