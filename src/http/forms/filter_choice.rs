//! The filters that a request for a map asks for.

use std::fmt::{Formatter, Result as FmtResult};

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};
use utoipa::openapi::schema::OneOfBuilder;
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use crate::json::{NO_FILTER, schema_of_words};
use mrol_map::bloom::FilterSettings;

/// An object with settings of filters, in which the server's default stands for what is left out; or `"none"`.
#[derive(Debug)]
pub(in crate::http) enum FilterChoice {
    Filter(FilterBody),
    NoFilter,
}

/// Settings of filters; what is left out is the server's default.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct FilterBody {
    /// Hash functions.
    #[schema(minimum = 1, maximum = 10)]
    hashes: Option<u32>,
    /// Bits of a plane a voxel, just before growth.
    #[schema(minimum = 1, maximum = 4096)]
    bits_per_key: Option<f64>,
}

impl FilterChoice {
    /// The settings; none of a map without filters.
    pub(in crate::http) fn or(self, default: FilterSettings) -> Option<FilterSettings> {
        match self {
            Self::NoFilter => None,
            Self::Filter(FilterBody { hashes, bits_per_key }) => Some(FilterSettings {
                hashes: hashes.unwrap_or(default.hashes),
                bits_per_key: bits_per_key.unwrap_or(default.bits_per_key),
            }),
        }
    }
}

impl Default for FilterChoice {
    fn default() -> Self {
        Self::Filter(FilterBody::default())
    }
}

impl ToSchema for FilterChoice {}

impl PartialSchema for FilterChoice {
    fn schema() -> RefOr<Schema> {
        OneOfBuilder::new().item(FilterBody::schema()).item(schema_of_words([NO_FILTER])).into()
    }
}

impl<'de> Deserialize<'de> for FilterChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ChoiceVisitor)
    }
}

struct ChoiceVisitor;

impl<'de> Visitor<'de> for ChoiceVisitor {
    type Value = FilterChoice;

    fn expecting(&self, f: &mut Formatter<'_>) -> FmtResult {
        write!(f, "an object with named fields or {NO_FILTER:?}")
    }

    fn visit_map<A: MapAccess<'de>>(self, fields: A) -> Result<FilterChoice, A::Error> {
        FilterBody::deserialize(MapAccessDeserializer::new(fields)).map(FilterChoice::Filter)
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<FilterChoice, E> {
        match word {
            NO_FILTER => Ok(FilterChoice::NoFilter),
            _ => Err(E::invalid_value(Unexpected::Str(word), &self)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_is_an_object_or_the_word_none_and_nothing_else() {
        let default = FilterSettings { hashes: 3, bits_per_key: 9.0 };
        let read = |json| serde_json::from_str::<FilterChoice>(json).map(|choice| choice.or(default));
        assert_eq!(read(r#""none""#).unwrap(), None);
        assert_eq!(read("{}").unwrap(), Some(default));
        assert_eq!(read(r#"{"hashes":1}"#).unwrap(), Some(FilterSettings { hashes: 1, ..default }));
        for bad in [r#""all""#, "null", "[2,14]", "false", r#"{"hash":1}"#] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
