//! Asking the node that leads a map.

use std::fmt::Debug;

use super::parts::Later;
use crate::error::ServiceError;
use crate::replication::NodeName;
use crate::request::{ScanAnswer, ScanRequest};
use mrol_map::map::{CallerName, MapName};

/// For whom a node asks another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OnBehalf {
    /// The name of the caller's key; none where no keys are asked for.
    pub caller: Option<CallerName>,
}

/// Asks the node that leads a map, for a caller of this one. The other node checks that caller's key as if it had come
/// itself, and takes the question no further.
///
/// Every call is made once: where it is not known what became of it, it fails with `outcome_unknown`.
pub trait Forward: Debug + Send + Sync {
    /// As [`MapService::insert_scan`](crate::MapService::insert_scan).
    fn insert_scan<'a>(
        &'a self,
        to: &'a NodeName,
        of: &'a OnBehalf,
        map: &'a MapName,
        scan: ScanRequest,
    ) -> Later<'a, Result<ScanAnswer, ServiceError>>;
}
