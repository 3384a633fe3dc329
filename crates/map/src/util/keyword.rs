//! Values that have a word of their own in settings, requests, options and metrics.

/// A closed set of values, each named by one word that is the same in settings, requests, options and metrics.
pub trait Keyword: Copy + PartialEq + std::fmt::Debug + Send + Sync + 'static {
    /// All values, in the order in which documentation lists them.
    const ALL: &'static [Self];

    /// The word of this value.
    fn as_str(self) -> &'static str;

    /// The value that `word` names, or none.
    fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|value| value.as_str() == word)
    }
}

/// The words of `T` as a sentence lists them: `"exact" or "bloom"`.
pub fn words<T: Keyword>() -> String {
    let words: Vec<String> = T::ALL.iter().map(|value| format!("{:?}", value.as_str())).collect();
    words.join(" or ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::Method;
    use crate::map::Lookup;

    fn check<T: Keyword>(expected: &str) {
        assert_eq!(words::<T>(), expected);
        assert!(T::ALL.iter().all(|value| T::from_word(value.as_str()) == Some(*value)));
        assert_eq!(T::from_word("Exact"), None);
    }

    #[test]
    fn a_value_is_read_from_the_word_that_it_prints() {
        check::<Method>(r#""refined" or "overlap""#);
        check::<Lookup>(r#""exact" or "bloom""#);
    }
}
