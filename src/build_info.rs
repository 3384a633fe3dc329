//! What was built.

/// Version of the crate.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The commit that was built, `+changes` behind it where files differed from it (those of commands and the
/// demonstration alone are not looked at); "unknown" where nobody said it.
pub const COMMIT: &str = env!("BUILT_COMMIT");

/// The features of the crate that were built, in their order of the alphabet.
pub const FEATURES: &str = env!("BUILT_FEATURES");

/// All three, a line each, as `mrol --version` says them.
pub const DESCRIPTION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit: ",
    env!("BUILT_COMMIT"),
    "\nfeatures: ",
    env!("BUILT_FEATURES"),
);
