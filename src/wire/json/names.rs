//! Names, as the description of the API has them: by the texts that they may be.

use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use crate::map::{KeepOutName, MapName, RequestId, RobotName, SessionName};

macro_rules! names {
    ($($name:ty: $pattern:literal, $description:literal;)+) => {$(
        impl ToSchema for $name {}

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                let text = ObjectBuilder::new().schema_type(Type::String).pattern(Some($pattern));
                text.description(Some($description)).into()
            }
        }

        #[cfg(test)]
        impl Patterned for $name {
            const PATTERN: &'static str = $pattern;
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

#[cfg(test)]
mod tests {
    use super::*;

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
