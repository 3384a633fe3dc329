//! Keep-outs to put, to remove and to list, and the answers.

use super::version::MapVersion;
use mrol_map::map::{KeepOut, KeepOutName, KeepOutShape, RequestId};

/// A keep-out to put: a new one, or in the place of the one of its name.
#[derive(Debug, Clone, PartialEq)]
pub struct PutKeepOut {
    /// Its name.
    pub name: KeepOutName,
    /// The space that it takes.
    pub shape: KeepOutShape,
    /// When the server ends it, nanoseconds since the Unix epoch; never where none.
    pub expires_at_ns: Option<i64>,
    /// The caller's own id of this change; makes it idempotent.
    pub request_id: Option<RequestId>,
}

/// A keep-out to remove.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeleteKeepOut {
    /// Its name.
    pub name: KeepOutName,
    /// The caller's own id of this change; makes it idempotent.
    pub request_id: Option<RequestId>,
}

/// What putting or removing a keep-out did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeepOutAnswer {
    /// After it.
    pub version: MapVersion,
    /// True of a change that was made before under its id: this is that answer.
    pub replayed: bool,
}

/// The keep-outs of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct KeepOutList {
    /// By name.
    pub keep_outs: Vec<KeepOut>,
    /// At this state.
    pub version: MapVersion,
}
