//! Keywords in JSON, query strings and settings.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{RefOr, Schema};

use mrol_map::util::{Keyword, excerpt, words};

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

/// The schema of a string that is one of these words.
pub fn schema_of_words<'a>(words: impl IntoIterator<Item = &'a str>) -> RefOr<Schema> {
    ObjectBuilder::new().schema_type(Type::String).enum_values(Some(words)).into()
}

/// Describes types that have words.
macro_rules! described_by_words {
    ($($of:ty),+) => {$(
        impl utoipa::ToSchema for $of {}

        impl utoipa::PartialSchema for $of {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::Schema> {
                $crate::json::schema_of_words(Self::ALL.iter().map(|value| value.as_str()))
            }
        }
    )+};
}

pub(crate) use described_by_words;
