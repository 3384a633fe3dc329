//! What is said of a setting that cannot be read: its key, where it stands, what belongs there and what is there.

use figment::error::{Actual, Kind, OneOf};
use figment::{Error, Source};

use super::variables::PREFIX;

/// The error and those behind it, a line each.
pub(super) fn described(error: &Error) -> String {
    let line = |error: Error| match (place(&error), problem(&error.kind)) {
        (place, problem) if place.is_empty() => problem,
        (place, problem) => format!("{place}: {problem}"),
    };
    error.clone().into_iter().map(line).collect::<Vec<_>>().join("\n")
}

/// The key in its source: `http.listen in mrol.toml`, or the name of a variable.
fn place(error: &Error) -> String {
    let metadata = error.metadata.as_ref();
    if metadata.is_some_and(|metadata| metadata.name.contains("environment variable")) {
        return PREFIX.to_owned() + &error.path.join("__").to_uppercase();
    }
    let key = error.path.join(".");
    match metadata.and_then(|metadata| metadata.source.as_ref()) {
        Some(Source::File(path)) if key.is_empty() => path.display().to_string(),
        Some(Source::File(path)) => format!("{key} in {}", path.display()),
        // The command line, whose parser names the option.
        _ => key,
    }
}

fn problem(kind: &Kind) -> String {
    match kind {
        Kind::InvalidType(found, expected) | Kind::InvalidValue(found, expected) => {
            format!("must be {}, got {}", in_words(expected), shown(found))
        }
        Kind::UnknownField(name, known) => format!("{name} is no setting; known are {}", OneOf(known)),
        Kind::UnknownVariant(found, known) => format!("must be {}, got {found:?}", OneOf(known)),
        Kind::MissingField(name) => format!("{name} is missing"),
        other => other.to_string(),
    }
}

/// What belongs there, where it is a type of Rust.
fn in_words(expected: &str) -> &str {
    match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, not negative",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "f32" | "f64" => "a number",
        "a boolean" => "true or false",
        "socket address" => "an address and a port, such as 127.0.0.1:7333",
        "a sequence" => "a list",
        "a map" => "a section of settings",
        other if other.starts_with("struct ") => "a section of settings",
        other => other,
    }
}

fn shown(found: &Actual) -> String {
    match found {
        Actual::Bool(value) => value.to_string(),
        Actual::Unsigned(value) => value.to_string(),
        Actual::Signed(value) => value.to_string(),
        Actual::Float(value) => value.to_string(),
        Actual::Str(value) => format!("{value:?}"),
        Actual::Seq => "a list".to_owned(),
        Actual::Map => "a section of settings".to_owned(),
        Actual::Unit | Actual::Option => "nothing".to_owned(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use serde_json::{Value, json};

    use super::super::settings::Config;

    fn refused(toml: &str, given: Value) -> String {
        let mut file = tempfile::NamedTempFile::with_suffix(".toml").unwrap();
        file.write_all(toml.as_bytes()).unwrap();
        let said = Config::load(Some(file.path()), given).unwrap_err().to_string();
        for inner in ["figment", "serde", ".rs", "u64", "usize", "default.", "global."] {
            assert!(!said.contains(inner), "{said} tells of {inner}");
        }
        said.replace(&*file.path().file_name().unwrap().to_string_lossy(), "FILE")
    }

    #[test]
    fn a_value_of_the_wrong_type_is_told_by_key_file_and_what_belongs_there() {
        for (toml, key, problem) in [
            ("drain_seconds = \"x\"", "drain_seconds in ", "must be a whole number, not negative, got \"x\""),
            (
                "[limits]\nmaps_max = -1",
                "limits.maps_max in ",
                "must be a whole number, not negative, got -1",
            ),
            (
                "[http]\nlisten = 3",
                "http.listen in ",
                "must be an address and a port, such as 127.0.0.1:7333, got 3",
            ),
            ("[robots.r1]\nkeep_zeros = 3", "robots.r1.keep_zeros in ", "must be true or false, got 3"),
            ("http = 3", "http in ", "must be a section of settings, got 3"),
        ] {
            let said = refused(toml, json!({}));
            assert!(said.starts_with(key) && said.ends_with(&format!("FILE: {problem}")), "{said}");
        }
        let unknown = refused("[http]\nlisen = \"a\"", json!({}));
        assert!(unknown.contains("lisen is no setting; known are `listen` or `socket`"), "{unknown}");
    }

    #[test]
    fn a_file_that_is_no_toml_and_an_option_are_told_without_what_reads_them() {
        let said = refused("drain_seconds = \n", json!({}));
        assert!(said.contains("FILE: TOML parse error at line 1, column 17"), "{said}");
        let said = refused("", json!({"store": {"durability": "often"}}));
        assert!(said.starts_with("store.durability: must be \"always\""), "{said}");
    }
}
