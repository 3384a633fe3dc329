//! Types of the core, as the description of the API has them: the core says nothing of itself in terms of JSON.
//!
//! Each stands for the type of its name where a schema asks for one.

use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use mrol_map::util::Keyword;
use mrol_map::{align, map, mapping, planning};

use super::keyword::schema_of_words;

/// Names, by the texts that they may be.
macro_rules! names {
    ($($name:ident: $pattern:literal, $description:literal;)+) => {$(
        #[doc = $description]
        #[derive(Debug)]
        pub struct $name;

        impl ToSchema for $name {}

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                let text = ObjectBuilder::new().schema_type(Type::String).pattern(Some($pattern));
                text.description(Some($description)).into()
            }
        }

        #[cfg(test)]
        impl Patterned for map::$name {
            const PATTERN: &'static str = $pattern;
        }
    )+};
}

/// Types that have words, by these.
macro_rules! words {
    ($($name:ident: $of:ty, $description:literal;)+) => {$(
        #[doc = $description]
        #[derive(Debug)]
        pub struct $name;

        impl ToSchema for $name {}

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                schema_of_words(<$of>::ALL.iter().map(|value| value.as_str()))
            }
        }
    )+};
}

#[cfg(test)]
trait Patterned {
    const PATTERN: &'static str;
}

names! {
    MapName: "^[a-z0-9][a-z0-9_-]{0,63}$", "The name of a map.";
    KeepOutName: "^[a-z0-9][a-z0-9_-]{0,63}$", "The name of a keep-out.";
    RobotName: "^[A-Za-z0-9_.-]{1,64}$", "The name of a robot.";
    SessionName: "^[A-Za-z0-9_.-]{0,64}$", "The name of one run of a robot's program.";
    RequestId: "^[A-Za-z0-9_.-]{1,64}$", "The caller's own id of a change.";
}

words! {
    BandFrom: planning::BandFrom, "What the heights of a band count from.";
    Lookup: map::Lookup, "A way to look up.";
    MeasuredTo: planning::MeasuredTo, "What a distance is measured to.";
    Method: align::Method, "A method of alignment.";
    Recovered: mapping::Recovered, "How a pose was recovered.";
    Unknown: planning::Unknown, "What unknown space counts as.";
    Verdict: align::Verdict, "A verdict on a scan.";
}

#[cfg(test)]
mod tests {
    use super::*;
    use map::{KeepOutName, MapName, RequestId, RobotName, SessionName};

    /// Holds a type's pattern against its constructor.
    #[track_caller]
    fn check<T: Patterned>(is_name: impl Fn(&str) -> bool) {
        let schema = serde_json::json!({"type": "string", "pattern": T::PATTERN});
        let schema = jsonschema::validator_for(&schema).unwrap();
        let long = "a".repeat(64);
        for text in
            ["", "a", "A", "0-_", "-a", "_a", ".a", "a.b", "a b", "\u{e4}", "a/b", &long, &format!("{long}a")]
        {
            assert_eq!(schema.is_valid(&text.into()), is_name(text), "{text:?}");
        }
    }

    #[test]
    fn the_described_names_are_those_that_are_taken() {
        check::<MapName>(|text| MapName::new(text).is_ok());
        check::<KeepOutName>(|text| KeepOutName::new(text).is_ok());
        check::<RobotName>(|text| RobotName::new(text).is_ok());
        check::<SessionName>(|text| SessionName::new(text).is_ok());
        check::<RequestId>(|text| RequestId::new(text).is_ok());
    }
}
