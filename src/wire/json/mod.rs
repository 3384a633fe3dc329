//! JSON and settings, written once for the HTTP interface, `--json` and the settings file.

mod keyword;

pub use keyword::ByKeyword;
