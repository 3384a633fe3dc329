//! Keywords in JSON, query strings and settings.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::util::{Keyword, excerpt, words};

/// A [`Keyword`] as JSON, query strings and settings write it: its word, a string.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ByKeyword<T>(pub T);

impl<'de, T: Keyword> Deserialize<'de> for ByKeyword<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let word = String::deserialize(deserializer)?;
        T::from_word(&word)
            .map(Self)
            .ok_or_else(|| D::Error::custom(format!("must be {}, got {:?}", words::<T>(), excerpt(&word))))
    }
}

impl<T: Keyword> Serialize for ByKeyword<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.as_str())
    }
}
