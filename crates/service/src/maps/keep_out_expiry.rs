//! The end of a map's keep-outs whose time is up: one attempt at a time, and whether it was put off.

use std::sync::atomic::AtomicBool;

/// Whether the expired keep-outs of a map are being ended, or cannot be.
#[derive(Debug, Default)]
pub(crate) struct KeepOutExpiry {
    /// Held while keep-outs are ended whose time is up.
    pub(crate) lock: tokio::sync::Mutex<()>,
    /// They cannot be ended, which was said.
    pub(crate) is_put_off: AtomicBool,
}
