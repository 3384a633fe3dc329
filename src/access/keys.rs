//! The keys that count.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use subtle::ConditionallySelectable;

use super::expiry::Expiry;
use super::key::Ended;
use super::key::{Key, KeyName};
use super::key_file;
use super::key_file::KeyFileError;
use super::reload::is_open_to_others;
use super::secret::Secret;

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
        let keys: Vec<_> = keys.into_iter().map(|key| Arc::new(continued(key, former))).collect();
        let gone = former.iter().filter(|key| !keys.iter().any(|other| Arc::ptr_eq(&key.end, &other.end)));
        gone.for_each(|key| key.end.come(Ended::Withdrawn));
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

    /// The key of a name: while one is being rotated, the one of its two that counts longer.
    pub(super) fn named(&self, name: &KeyName) -> Option<Arc<Key>> {
        let of_name = self.0.iter().filter(|key| key.name == *name);
        // One without an end counts for ever.
        of_name.max_by_key(|key| (key.expires.is_none(), key.expires)).cloned()
    }

    /// Ends what was begun with keys whose time is up at `now`; to be called every second or so.
    pub(super) fn end_expired(&self, now: SystemTime) {
        let expired = self.0.iter().filter(|key| key.is_expired(now));
        expired.for_each(|key| key.end.come(Ended::Expired));
    }

    /// The keys whose time is up at `now` or within `warning`, with their ends.
    pub(super) fn expiring(&self, now: SystemTime, warning: Duration) -> Vec<(KeyName, Expiry)> {
        let ends = self.0.iter().filter_map(|key| Some((key.name.clone(), key.expires?)));
        ends.filter(|(_, expires)| expires.is_near(now, warning)).collect()
    }

    /// The number of keys, with the former secrets of keys that are being rotated.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Never, where they come of a file.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// The key as it was before the file was read again, where it was there: what was begun with it goes on, and what its
/// limits have left stays.
fn continued(key: Key, former: &[Arc<Key>]) -> Key {
    let same = former.iter().find(|other| other.is_same_as(&key) && !other.end.has_come());
    let end = same.map_or_else(|| Arc::clone(&key.end), |same| Arc::clone(&same.end));
    let alike = |other: &&Arc<Key>| other.name == key.name && other.allowance.limits == key.allowance.limits;
    let allowance = former.iter().find(alike).map(|other| Arc::clone(&other.allowance));
    Key { end, allowance: allowance.unwrap_or_else(|| Arc::clone(&key.allowance)), ..key }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::key::KeyName;
    use crate::access::scope::Scope;
    use mrol_service::{AllowedMaps, Reason};

    fn key(name: &str, secret: &str, scope: Scope) -> Key {
        let name = KeyName::new(name).unwrap();
        Key::new(name, Secret::new(secret).digest(), scope, AllowedMaps::Every)
    }

    #[test]
    fn a_secret_opens_with_its_own_key_alone() {
        let keys = Keys::after(None, vec![key("a", "1", Scope::Read), key("b", "2", Scope::Admin)]);
        let found = |secret| keys.find(&Secret::new(secret)).map(|key| key.name.to_string());
        assert_eq!((found("1").as_deref(), found("2").as_deref()), (Some("a"), Some("b")));
        assert_eq!((found("3"), found("")), (None, None));
    }

    #[test]
    fn of_the_two_secrets_of_a_key_its_name_stands_for_the_one_that_counts_longer() {
        let [soon, late] = ["2027-01-31", "2028-01-31"].map(|text| Expiry::parse(text).unwrap());
        let found = |keys: Vec<Key>| {
            let keys = Keys::after(None, keys);
            keys.named(&KeyName::new("a").unwrap()).unwrap().expires
        };
        let a = || key("a", "1", Scope::Read);
        let former = |end| a().former(Secret::new("0").digest(), Some(end));
        assert_eq!(found(vec![former(soon), a()]), None);
        assert_eq!(found(vec![a(), former(soon)]), None);
        assert_eq!(
            found(vec![a().until(late), a().until(late).former(Secret::new("0").digest(), Some(soon))]),
            Some(late)
        );
        assert!(Keys::after(None, vec![a()]).named(&KeyName::new("b").unwrap()).is_none());
    }

    #[test]
    fn keys_that_change_or_go_are_withdrawn_and_others_are_not() {
        let keys = |second| vec![key("a", "1", Scope::Read), key("b", "2", second)];
        let former = Keys::after(None, keys(Scope::Admin));
        let same = Keys::after(Some(&former), keys(Scope::Admin));
        assert!(same.0.iter().zip(&former.0).all(|(new, old)| Arc::ptr_eq(&new.end, &old.end)));
        let less = Keys::after(Some(&same), keys(Scope::Write));
        assert!(!less.0[0].end.has_come() && former.0[1].end.has_come());
        Keys::after(Some(&less), Vec::new());
        assert!(former.0[0].end.has_come());
    }

    #[test]
    fn a_key_that_is_prolonged_goes_on_and_one_whose_time_is_up_ends_with_that_reason() {
        let until = |text| vec![key("a", "1", Scope::Read).until(Expiry::parse(text).unwrap())];
        let first = Keys::after(None, until("2027-01-31"));
        let longer = Keys::after(Some(&first), until("2027-02-28"));
        assert!(!first.0[0].end.has_come() && Arc::ptr_eq(&first.0[0].allowance, &longer.0[0].allowance));
        let at = |s| SystemTime::UNIX_EPOCH + Duration::from_secs(s);
        longer.end_expired(at(1_801_353_600));
        assert!(!first.0[0].end.has_come());
        longer.end_expired(at(1_803_772_800));
        assert!(first.0[0].end.has_come());
        assert_eq!(first.0[0].ended().reason, Reason::KeyExpired);
        // Prolonged after its end it is another beginning.
        let again = Keys::after(Some(&longer), until("2028-01-31"));
        assert!(!again.0[0].end.has_come());
        assert_eq!(longer.expiring(at(0), Duration::from_secs(1)), []);
        assert_eq!(longer.expiring(at(1_803_772_790), Duration::from_secs(10)).len(), 1);
    }
}
