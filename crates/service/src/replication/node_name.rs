//! Names of nodes.

use std::fmt;
use std::sync::Arc;

/// Characters that a name may have, at most.
const LENGTH_MAX: usize = 64;

/// The name of a node of a cluster: `[a-z0-9][a-z0-9_-]{0,63}`, so that it can be part of a key or a subject.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeName(Arc<str>);

/// Why a text is no node's name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("node must match [a-z0-9][a-z0-9_-]{{0,63}}, got {0:?}")]
pub struct BadNodeName(String);

impl NodeName {
    /// Checks a text.
    ///
    /// # Errors
    /// Names the text and what a name looks like.
    pub fn new(text: &str) -> Result<Self, BadNodeName> {
        let first = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit();
        let bytes = text.as_bytes();
        let fits = bytes.len() <= LENGTH_MAX
            && bytes.first().is_some_and(|&c| first(c))
            && bytes.iter().all(|&c| first(c) || c == b'_' || c == b'-');
        match fits {
            true => Ok(Self(text.into())),
            false => Err(BadNodeName(text.chars().take(LENGTH_MAX).collect())),
        }
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for NodeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_name_can_be_part_of_a_subject() {
        for good in ["a", "0", "node-2_b", &"x".repeat(64)] {
            assert!(NodeName::new(good).is_ok(), "{good}");
        }
        for bad in ["", "A", "-a", "a.b", "a b", "a*", ">", "ä", &"x".repeat(65)] {
            assert!(NodeName::new(bad).is_err(), "{bad}");
        }
    }
}
