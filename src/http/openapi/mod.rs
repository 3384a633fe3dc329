//! `GET /openapi.json`: the description of the HTTP interface (OpenAPI 3.1).
//!
//! It comes from the types and the comments of the handlers, each of which says in its attribute what it takes and what
//! it answers. What the table of operations knows (names, keys), the names in paths, and the failures that all have are
//! filled in here. A test holds attributes, routes, table and contract against each other, and another one every JSON
//! answer against its schema.

mod document;
mod failures;
mod from_table;
mod optional_parts;
mod request_id;

pub use document::openapi_json;
