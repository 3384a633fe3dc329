//! The keys that count.

use std::path::Path;
use std::sync::Arc;

use subtle::ConditionallySelectable;

use super::key_file::{self, KeyFileError};
use super::{Key, Secret};
use crate::reload::is_open_to_others;

/// All keys of a file.
#[derive(Debug)]
pub struct Keys(Vec<Arc<Key>>);

impl Keys {
    /// The keys of a file. What is the same in `former` stays as it is; what is there no longer is withdrawn.
    ///
    /// # Errors
    /// When the file cannot be read or holds something else than keys; nothing is withdrawn then.
    pub(super) fn read(path: &Path, former: Option<&Self>) -> Result<Self, KeyFileError> {
        let keys = key_file::read(path)?;
        if is_open_to_others(path) {
            tracing::warn!(path = %path.display(), "everybody on this machine may read or write the file of keys");
        }
        Ok(Self::after(former, keys))
    }

    fn after(former: Option<&Self>, keys: Vec<Key>) -> Self {
        let former = former.map(|keys| keys.0.as_slice()).unwrap_or_default();
        let kept = |key: &Key| former.iter().find(|other| other.is_same_as(key)).cloned();
        let keys: Vec<_> = keys.into_iter().map(|key| kept(&key).unwrap_or_else(|| Arc::new(key))).collect();
        let gone = former.iter().filter(|key| !keys.iter().any(|other| Arc::ptr_eq(key, other)));
        gone.for_each(|key| key.withdrawn.cancel());
        Self(keys)
    }

    /// The key of a secret. How long it takes tells nothing of which it is, or of how near to one.
    pub(super) fn find(&self, secret: &Secret) -> Option<Arc<Key>> {
        let digest = secret.digest();
        let mut place = u32::MAX;
        for (i, key) in (0..).zip(&self.0) {
            place.conditional_assign(&i, key.digest.same_as(&digest));
        }
        self.0.get(place as usize).cloned()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Never, where they come of a file.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::{KeyName, Scope};
    use crate::service::MapReach;

    fn key(name: &str, secret: &str, scope: Scope) -> Key {
        let name = KeyName::new(name).unwrap();
        Key::new(name, Secret::new(secret).digest(), scope, MapReach::Every)
    }

    #[test]
    fn a_secret_opens_with_its_own_key_alone() {
        let keys = Keys::after(None, vec![key("a", "1", Scope::Read), key("b", "2", Scope::Admin)]);
        let found = |secret| keys.find(&Secret::new(secret)).map(|key| key.name.to_string());
        assert_eq!((found("1").as_deref(), found("2").as_deref()), (Some("a"), Some("b")));
        assert_eq!((found("3"), found("")), (None, None));
    }

    #[test]
    fn keys_that_change_or_go_are_withdrawn_and_others_are_not() {
        let keys = |second| vec![key("a", "1", Scope::Read), key("b", "2", second)];
        let former = Keys::after(None, keys(Scope::Admin));
        let same = Keys::after(Some(&former), keys(Scope::Admin));
        assert!(same.0.iter().zip(&former.0).all(|(new, old)| Arc::ptr_eq(new, old)));
        let less = Keys::after(Some(&same), keys(Scope::Write));
        assert!(!less.0[0].withdrawn.is_cancelled() && former.0[1].withdrawn.is_cancelled());
        Keys::after(Some(&less), Vec::new());
        assert!(former.0[0].withdrawn.is_cancelled());
    }
}
