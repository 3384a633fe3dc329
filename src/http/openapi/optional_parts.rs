//! Parts of an answer's object that may be missing as a whole.
//!
//! utoipa describes a flattened `Option` by its fields or null, and no object is null: every answer without the part
//! would contradict its schema.

use utoipa::openapi::schema::{AnyOfBuilder, ObjectBuilder, OneOf, SchemaType, Type};
use utoipa::openapi::{RefOr, Schema};

/// Has the part of a composed object that may be null be missing instead.
pub(super) fn mend(schema: &mut RefOr<Schema>) {
    let RefOr::T(Schema::AllOf(parts)) = schema else { return };
    for part in &mut parts.items {
        if let RefOr::T(Schema::OneOf(OneOf { items, .. })) = part
            && let [fields, null] = items.as_slice()
            && is_null(null)
        {
            *part = AnyOfBuilder::new().item(fields.clone()).item(ObjectBuilder::new()).into();
        }
    }
}

fn is_null(schema: &RefOr<Schema>) -> bool {
    matches!(schema, RefOr::T(Schema::Object(of)) if matches!(of.schema_type, SchemaType::Type(Type::Null)))
}
