//! Every format: the same points, in files built byte by byte.

mod bare;
mod broken;
mod files;
mod formats;
mod messages;
mod odd_headers;
mod odd_text;
