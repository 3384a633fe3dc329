//! `GET /openapi.json`, the description of the HTTP interface, and `GET /docs`, a page that shows it and sends
//! requests.
//!
//! The page and what starts it are here; what shows the description is Swagger UI, embedded by its crate. Nothing comes
//! from another host. Addresses are relative, so that a proxy may serve it below another path.

pub(super) mod description;
pub(super) mod page;
