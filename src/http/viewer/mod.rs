//! `GET /` and `GET /viewer/{file}`: the page that draws a map in a browser.
//!
//! The page is the same for everybody and asks for no key; all that it shows comes from the other routes, which do. It
//! names nothing but what it came from, by relative links, so that it works behind a proxy that puts a prefix before
//! it.

pub(super) mod files;
/// Named by the description, which needs what stands beside the handlers.
pub(super) mod pages;
