//! The header that every answer has.

use utoipa::openapi::header::{Header, HeaderBuilder};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{RefOr, Schema};

/// The header by which a request is found in the log.
pub(super) fn request_id() -> Header {
    let text: RefOr<Schema> = ObjectBuilder::new().schema_type(Type::String).into();
    HeaderBuilder::new().schema(Some(text)).description(Some("The id of the request, in the log too")).build()
}
