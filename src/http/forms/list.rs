//! Lists in JSON that are bounded as they are read.

use std::fmt::{Formatter, Result as FmtResult};
use std::marker::PhantomData;

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A list of at most `MOST` entries: no more are read. For entries that may be shorter in JSON than what is made of
/// them.
#[derive(Debug)]
pub(in crate::http) struct List<T, const MOST: usize>(pub(in crate::http) Vec<T>);

impl<T, const MOST: usize> Default for List<T, MOST> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>, const MOST: usize> Deserialize<'de> for List<T, MOST> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(ListVisitor(PhantomData))
    }
}

struct ListVisitor<T, const MOST: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de>, const MOST: usize> Visitor<'de> for ListVisitor<T, MOST> {
    type Value = List<T, MOST>;

    fn expecting(&self, f: &mut Formatter<'_>) -> FmtResult {
        write!(f, "an array of at most {MOST} entries")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = seq.next_element()? {
            if entries.len() == MOST {
                return Err(A::Error::custom(format!("the array has more than {MOST} entries")));
            }
            entries.push(entry);
        }
        Ok(List(entries))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_that_are_too_many_are_not_read() {
        let read = |text: &str| serde_json::from_str::<List<u8, 3>>(text).map(|list| list.0);
        assert_eq!(read("[]").unwrap(), [0; 0]);
        assert_eq!(read("[1, 2, 3]").unwrap(), [1, 2, 3]);
        // What follows is not looked at, whatever it is.
        let refused = read("[1, 2, 3, 4, -5").unwrap_err().to_string();
        assert!(refused.contains("the array has more than 3 entries"), "{refused}");
        let refused = read("{}").unwrap_err().to_string();
        assert!(refused.contains("an array of at most 3 entries"), "{refused}");
    }
}
