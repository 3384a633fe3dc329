//! The name of a key, as options take it.

use mrol::access::KeyName;

/// Parses the name of a key.
pub(super) fn name(text: &str) -> Result<KeyName, String> {
    KeyName::new(text).ok_or_else(|| format!("a name is 1 to 64 of [A-Za-z0-9_.-], got {text:?}"))
}
