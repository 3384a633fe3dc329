//! What is said of JSON and of parameters that cannot be read: in the words of who wrote them.
//!
//! serde speaks of the types that a value was to become. Here its messages get the place of the value in the request,
//! and what belongs there as JSON knows it.

use serde::de::DeserializeOwned;

use super::object::Object;

/// What serde expects, and what that is for who writes a request.
const KINDS: [(&str, &str); 10] = [
    ("u8", "a whole number from 0 to 255"),
    ("u32", "a whole number from 0 to 4294967295"),
    ("u64", "a whole number from 0 to 18446744073709551615"),
    ("usize", "a whole number, 0 or more"),
    ("i32", "a whole number from -2147483648 to 2147483647"),
    ("i64", "a whole number from -9223372036854775808 to 9223372036854775807"),
    ("f32", "a number"),
    ("f64", "a number"),
    ("a boolean", "true or false"),
    ("a sequence", "an array"),
];

/// What serde found, and what JSON calls it.
const FOUND: [(&str, &str); 3] = [("sequence", "an array"), ("map", "an object"), ("unit value", "null")];

/// What the standard library says of texts that are no values, and what belongs there.
const PARAMETERS: [(&str, &str); 6] = [
    ("invalid digit found in string", "must be a whole number"),
    ("cannot parse integer from empty string", "must be a whole number, got nothing"),
    ("number too large to fit in target type", "is too large"),
    ("number too small to fit in target type", "is too small"),
    ("invalid float literal", "must be a number"),
    ("provided string was not `true` or `false`", "must be true or false"),
];

/// Why `body` is no object of this kind: where, what is there and what belongs there. It is read once more for the
/// place, which is not kept while a body is read that may be as large as its limit.
pub(in crate::http) fn body<T: DeserializeOwned>(body: &[u8], error: &serde_json::Error) -> String {
    let mut json = serde_json::Deserializer::from_slice(body);
    let Err(placed) = serde_path_to_error::deserialize::<_, Object<T>>(&mut json) else {
        return format!("body: {}", in_plain_words(&error.to_string()));
    };
    let path = placed.path().to_string();
    // Where it ends before a name is read, the place is a question mark; that of the whole is a dot.
    let path = path.trim_end_matches(['.', '?']);
    let separator = if path.is_empty() { "" } else { ": " };
    format!("body: {path}{separator}{}", in_plain_words(&placed.inner().to_string()))
}

/// Why the parameters of an address cannot be read; `error` begins with the name of the parameter.
pub(in crate::http) fn query(error: &str) -> String {
    let known = PARAMETERS.iter().find(|(said, _)| error.ends_with(said));
    match known {
        Some((said, plain)) => {
            format!("query: {}{plain}", error.trim_end_matches(said).replacen(": ", " ", 1))
        }
        None => format!("query: {}", error.replacen("unknown field", "unknown parameter", 1)),
    }
}

/// `invalid type: FOUND, expected KIND at line 1 column 7`, with both as JSON knows them.
fn in_plain_words(message: &str) -> String {
    let Some((before, expected)) = message.rsplit_once(", expected ") else { return message.to_owned() };
    let (kind, place) = expected.split_once(" at line ").unwrap_or((expected, ""));
    let kind = KINDS.iter().find(|(name, _)| *name == kind).map_or(kind, |(_, plain)| plain);
    let place = if place.is_empty() { String::new() } else { format!(" at line {place}") };
    let found = before.strip_prefix("invalid type: ").or_else(|| before.strip_prefix("invalid value: "));
    match found {
        Some(found) => {
            let found = FOUND.iter().find(|(name, _)| *name == found).map_or(found, |(_, plain)| plain);
            format!("must be {kind}, got {found}{place}")
        }
        None => format!("{before}, expected {kind}{place}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Request {
        #[serde(rename = "level")]
        _level: u32,
        #[serde(rename = "corner_m")]
        _corner_m: Option<[f64; 3]>,
    }

    #[test]
    fn a_value_is_named_by_its_place_and_by_what_belongs_there() {
        for (text, said) in [
            (
                r#"{"level": "x"}"#,
                "body: level: must be a whole number from 0 to 4294967295, got string \"x\" at line 1",
            ),
            (
                r#"{"level": []}"#,
                "body: level: must be a whole number from 0 to 4294967295, got an array at line 1",
            ),
            (
                r#"{"level": 1, "corner_m": [0, 0, true]}"#,
                "body: corner_m[2]: must be a number, got boolean `true`",
            ),
            (r#"{"level": 1, "corner_m": [0, 0]}"#, "body: corner_m: invalid length 2"),
            (r#"{"level": 1, "hue": 2}"#, "unknown field `hue`, expected `level` or `corner_m`"),
            ("[1]", "body: must be an object with named fields, got an array at line 1"),
            ("{", "body: EOF while parsing an object at line 1"),
            (r#"{"level": 1} x"#, "body: trailing characters at line 1"),
        ] {
            let error = serde_json::from_str::<Object<Request>>(text).unwrap_err();
            let message = body::<Request>(text.as_bytes(), &error);
            assert!(message.contains(said), "{text}: {message}");
        }
    }

    #[test]
    fn a_parameter_is_named_with_what_belongs_there() {
        assert_eq!(query("level: invalid digit found in string"), "query: level must be a whole number");
        assert_eq!(query("unknown field `hue`"), "query: unknown parameter `hue`");
    }
}
