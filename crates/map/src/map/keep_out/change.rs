//! What happens to keep-outs.

use super::shape::KeepOutShape;
use crate::map::name::{CallerName, KeepOutName};

/// Something that happened to a keep-out.
#[derive(Debug, Clone, PartialEq)]
pub struct KeepOutChange {
    /// Of which.
    pub name: KeepOutName,
    /// What.
    pub act: KeepOutAct,
}

/// What happens to a keep-out.
#[derive(Debug, Clone, PartialEq)]
pub enum KeepOutAct {
    /// It is made, or takes the place of the one of its name.
    Put {
        /// The space that it takes.
        shape: KeepOutShape,
        /// The name of the key that it was made with; none without a key.
        made_by: Option<CallerName>,
        /// When the server ends it, nanoseconds since the Unix epoch; never where none.
        expires_at_ns: Option<i64>,
    },
    /// Somebody removed it.
    Removed {
        /// The name of the key that it was removed with; none without a key.
        by: Option<CallerName>,
    },
    /// Its time was up.
    Expired,
}

impl KeepOutChange {
    /// Bytes of memory that the corners of its shape take.
    pub fn corner_bytes(&self) -> usize {
        match &self.act {
            KeepOutAct::Put { shape, .. } => shape.corners() * size_of::<[f64; 2]>(),
            KeepOutAct::Removed { .. } | KeepOutAct::Expired => 0,
        }
    }
}
