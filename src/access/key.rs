//! A key: its holder, and what it is for.

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};
use std::time::SystemTime;

use tokio_util::sync::CancellationToken;

use super::allowance::{Allowance, KeyLimits};
use super::expiry::Expiry;
use super::scope::Scope;
use super::secret::Digest;
use mrol_map::map::RobotName;
use mrol_service::{AllowedMaps, AllowedScans, Reason, ServiceError};

/// Characters of a key's name, at most.
const NAME_LENGTH_MAX: usize = 64;

/// The holder of a key: 1 to 64 of `[A-Za-z0-9_.-]`, fit for a log line and a metric's label.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct KeyName(Arc<str>);

/// A key as the server knows it: a secret's hash and what it opens.
#[derive(Debug)]
pub struct Key {
    pub(super) name: KeyName,
    pub(super) digest: Digest,
    pub(super) scope: Scope,
    pub(super) allowed_maps: AllowedMaps,
    pub(super) robots: Option<Arc<BTreeSet<RobotName>>>,
    pub(super) expires: Option<Expiry>,
    pub(super) allowance: Arc<Allowance>,
    pub(super) end: Arc<End>,
}

/// The end of a key, which what was begun with it waits for.
#[derive(Debug, Default)]
pub(super) struct End {
    token: CancellationToken,
    reason: OnceLock<Ended>,
}

/// Why a key counts no longer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ended {
    Withdrawn,
    Expired,
}

impl Key {
    /// A key that counts, for every robot and for ever.
    pub fn new(name: KeyName, digest: Digest, scope: Scope, allowed_maps: AllowedMaps) -> Self {
        Self {
            name,
            digest,
            scope,
            allowed_maps,
            robots: None,
            expires: None,
            allowance: Arc::new(Allowance::new(KeyLimits::default())),
            end: Arc::default(),
        }
    }

    /// This key, for the scans of `robots` alone.
    pub fn for_robots(self, robots: impl IntoIterator<Item = RobotName>) -> Self {
        Self { robots: Some(Arc::new(robots.into_iter().collect())), ..self }
    }

    /// This key, which counts until `expires`.
    pub fn until(self, expires: Expiry) -> Self {
        Self { expires: Some(expires), ..self }
    }

    /// This key, with limits of its own.
    pub fn with_limits(self, limits: KeyLimits) -> Self {
        Self { allowance: Arc::new(Allowance::new(limits)), ..self }
    }

    /// The key's former secret during a rotation, with an end of its own: until then both secrets count.
    pub(super) fn former(&self, digest: Digest, expires: Option<Expiry>) -> Self {
        Self {
            name: self.name.clone(),
            digest,
            scope: self.scope,
            allowed_maps: self.allowed_maps.clone(),
            robots: self.robots.clone(),
            expires: [self.expires, expires].into_iter().flatten().min(),
            allowance: Arc::clone(&self.allowance),
            end: Arc::default(),
        }
    }

    /// True where both open the same to the same; until when, and how often, may differ.
    pub(super) fn is_same_as(&self, other: &Self) -> bool {
        (&self.name, self.digest, self.scope, &self.allowed_maps, &self.robots)
            == (&other.name, other.digest, other.scope, &other.allowed_maps, &other.robots)
    }

    /// Whose scans its holder may send and undo.
    pub(super) fn allowed_scans(&self) -> AllowedScans {
        let writes = self.scope >= Scope::Write;
        AllowedScans { robots: self.robots.clone(), undo_of_others: writes, carving_on_request: writes }
    }

    /// True where its time is up at `now`.
    pub(super) fn is_expired(&self, now: SystemTime) -> bool {
        self.expires.is_some_and(|expires| expires.is_past(now))
    }

    /// Why nobody gets in with it any more, where that is so at `now`.
    pub(super) fn expired(&self, now: SystemTime) -> Option<ServiceError> {
        let expires = self.expires.filter(|_| self.is_expired(now))?;
        let message = format!("key {} expired at {expires}: ask for a new one", self.name);
        Some(ServiceError::new(Reason::KeyExpired, message))
    }

    /// What to tell whoever was let in with it when it ended.
    pub(super) fn ended(&self) -> ServiceError {
        let (reason, what) = match self.end.reason.get() {
            Some(Ended::Expired) => (Reason::KeyExpired, "expired"),
            Some(Ended::Withdrawn) | None => (Reason::KeyWithdrawn, "was withdrawn or changed"),
        };
        ServiceError::new(reason, format!("key {} {what}", self.name))
    }
}

impl End {
    /// Ends what was begun with the key.
    pub(super) fn come(&self, reason: Ended) {
        // The first reason is the one.
        let _ = self.reason.set(reason);
        self.token.cancel();
    }

    pub(super) fn has_come(&self) -> bool {
        self.token.is_cancelled()
    }

    pub(super) fn token(&self) -> &CancellationToken {
        &self.token
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
