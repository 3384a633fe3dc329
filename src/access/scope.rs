//! How much a key may do.

use std::fmt;
use std::fmt::Display;

use serde::{Deserialize, Serialize};

/// What a key may do; each holds what those before it may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scope {
    /// Everything that changes nothing.
    Read,
    /// Scans, and undo of the scans of its own robots.
    Insert,
    /// Changes of what maps hold: deletions, undo of any scan.
    Write,
    /// Making, restoring and deleting maps.
    Admin,
}

impl Scope {
    /// All, the least first.
    pub const ALL: [Self; 4] = [Self::Read, Self::Insert, Self::Write, Self::Admin];

    /// The scope's word in files, errors and on the command line.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Insert => "insert",
            Self::Write => "write",
            Self::Admin => "admin",
        }
    }
}

impl Display for Scope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
