//! A key: who holds it, and what it is for.

use tokio_util::sync::CancellationToken;

use super::{Digest, Scope};
use crate::service::MapReach;

/// Characters of a key's name, at most.
const NAME_LENGTH_MAX: usize = 64;

/// Who a key was made for: 1 to 64 of `[A-Za-z0-9_.-]`, fit for a log line and a metric's label.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct KeyName(std::sync::Arc<str>);

/// A key as the server knows it.
#[derive(Debug)]
pub struct Key {
    pub(super) name: KeyName,
    pub(super) digest: Digest,
    pub(super) scope: Scope,
    pub(super) reach: MapReach,
    /// Set when it counts no longer.
    pub(super) withdrawn: CancellationToken,
}

impl Key {
    /// A key that counts.
    pub fn new(name: KeyName, digest: Digest, scope: Scope, reach: MapReach) -> Self {
        Self { name, digest, scope, reach, withdrawn: CancellationToken::new() }
    }

    /// True where both open the same to the same.
    pub(super) fn is_same_as(&self, other: &Self) -> bool {
        (&self.name, self.digest, self.scope, &self.reach)
            == (&other.name, other.digest, other.scope, &other.reach)
    }
}

impl KeyName {
    /// Checks a text; none where it is no name.
    pub fn new(text: &str) -> Option<Self> {
        let fits = |c: u8| c.is_ascii_alphanumeric() || b"_.-".contains(&c);
        let is_name = (1..=NAME_LENGTH_MAX).contains(&text.len()) && text.bytes().all(fits);
        is_name.then(|| Self(text.into()))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl std::fmt::Display for KeyName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}
