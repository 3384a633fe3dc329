//! Objects of JSON that are written as objects.

use std::fmt::{Formatter, Result as FmtResult};
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A value that is written as an object with named fields, and in no other way.
///
/// A derived structure alone takes an array of its fields' values as well, in the order of the source: a request that
/// somebody wrote by mistake would then mean something, and something else after the next release.
#[derive(Debug, Default)]
pub(in crate::http) struct Object<T>(pub(in crate::http) T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Object<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(ObjectVisitor(PhantomData)).map(Self)
    }
}

struct ObjectVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for ObjectVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut Formatter<'_>) -> FmtResult {
        f.write_str("an object with named fields")
    }

    fn visit_map<A: MapAccess<'de>>(self, fields: A) -> Result<T, A::Error> {
        T::deserialize(MapAccessDeserializer::new(fields))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Pair {
        a: u32,
        b: Option<u32>,
    }

    #[test]
    fn an_object_is_read_by_its_names_and_an_array_is_none() {
        let Object(Pair { a, b }) = serde_json::from_str(r#"{"b": 2, "a": 1}"#).unwrap();
        assert_eq!((a, b), (1, Some(2)));
        for (bad, word) in
            [("[1, 2]", "an object with named fields"), ("7", "an object"), (r#"{"a": 1, "c": 2}"#, "`c`")]
        {
            let error = serde_json::from_str::<Object<Pair>>(bad).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
