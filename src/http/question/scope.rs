//! What all questions have in common: which level, which state of which map, and whether keep-outs count.

use mrol_client::wire::pb;
use mrol_map::map::MapName;

/// The body of a question: its own fields, and those that all questions have.
pub(in crate::http) trait Scoped {
    /// Takes what all questions have, as a message about `map` has it.
    fn take_scope(&mut self, map: &MapName) -> pb::Asked;
}

/// Declares the body of a question: the fields that are given, and after them those that all questions have. A new
/// option of all questions is a field here.
///
/// Flattening a struct with these fields into each body would be shorter, but what is flattened can no longer refuse
/// unknown fields.
macro_rules! question_body {
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $Body:ident {
            $($(#[$of_field:meta])* $field:ident: $Field:ty,)*
        }
    ) => {
        #[derive(serde::Deserialize, utoipa::ToSchema)]
        $(#[$attribute])*
        #[serde(deny_unknown_fields)]
        $visibility struct $Body {
            $($(#[$of_field])* $field: $Field,)*
            /// The level, 0 the finest; 0 without.
            #[serde(default)]
            level: u32,
            /// The answer waits until the map has reached this revision, at most `limits.min_revision_wait_max_s`.
            min_revision: Option<u64>,
            /// The map that the answer must speak of: another one is refused (`map_replaced`).
            #[schema(format = "uuid")]
            map_uuid: Option<String>,
            /// Whether keep-outs count for nothing; false without: they count as occupied.
            #[serde(default)]
            ignore_keep_outs: bool,
        }

        impl $crate::http::question::scope::Scoped for $Body {
            fn take_scope(&mut self, map: &mrol_map::map::MapName) -> mrol_client::wire::pb::Asked {
                mrol_client::wire::pb::Asked {
                    map: map.to_string(),
                    level: self.level,
                    min_revision: self.min_revision,
                    map_uuid: self.map_uuid.take().unwrap_or_default(),
                    ignore_keep_outs: self.ignore_keep_outs,
                }
            }
        }
    };
}

pub(super) use question_body;
