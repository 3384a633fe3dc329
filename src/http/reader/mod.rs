//! `GET /docs`: a page that shows the description of the HTTP interface and sends requests from it.
//!
//! The page and what starts it are here; what shows the description is Swagger UI, embedded by its crate. Nothing comes
//! from another host. Addresses are relative, so that a proxy may serve it below another path.

/// Named by the description, which needs what stands beside the handlers.
pub(super) mod page;
