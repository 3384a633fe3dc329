//! How another node is asked.

use std::fmt::Debug;
use std::pin::Pin;
use std::sync::Arc;

use tokio_stream::Stream;

use super::later::Later;
use crate::error::ServiceError;
use crate::replication::NodeName;
use crate::request::{
    DeleteKeepOut, Deletion, DeletionAnswer, EventMessage, EventsQuery, KeepOutAnswer, PutKeepOut,
    ScanAnswer, ScanEvent, ScanRequest, Undo, UndoAnswer,
};
use mrol_map::map::{CallerName, MapName};
use mrol_map::mapping::Sighting;

/// A call that goes on to another node: which one, for whom, and about which map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ForwardedCall {
    /// The node that is asked.
    pub to: NodeName,
    /// The name of the caller's key; none where no keys are asked for.
    pub caller: Option<CallerName>,
    /// The map.
    pub map: MapName,
}

/// The messages of another node's watch of events.
pub type ForwardedEvents = Pin<Box<dyn Stream<Item = Result<EventMessage, ServiceError>> + Send>>;

/// Asks another node, for a caller of this one, what [`MapService`](crate::MapService) has under the same name. The
/// other node checks the caller's key as if its holder had come to it, and takes the call no further: it fails with
/// `not_leader` where that node does not lead the map either.
///
/// Every call is made once. It fails with `no_quorum` where the other node cannot be reached, and so nothing was
/// changed; with `outcome_unknown` where a change was sent and nobody knows what became of it; and otherwise as the
/// other node says.
pub trait Forward: Debug + Send + Sync {
    /// Inserts a scan.
    fn insert_scan<'a>(
        &'a self,
        call: &'a ForwardedCall,
        scan: ScanRequest,
    ) -> Later<'a, Result<ScanAnswer, ServiceError>>;

    /// Takes voxels out.
    fn delete_voxels<'a>(
        &'a self,
        call: &'a ForwardedCall,
        deletion: Deletion,
    ) -> Later<'a, Result<DeletionAnswer, ServiceError>>;

    /// Takes scans or a deletion back.
    fn undo<'a>(&'a self, call: &'a ForwardedCall, undo: Undo)
    -> Later<'a, Result<UndoAnswer, ServiceError>>;

    /// Puts a keep-out.
    fn put_keep_out<'a>(
        &'a self,
        call: &'a ForwardedCall,
        put: PutKeepOut,
    ) -> Later<'a, Result<KeepOutAnswer, ServiceError>>;

    /// Removes a keep-out.
    fn delete_keep_out<'a>(
        &'a self,
        call: &'a ForwardedCall,
        deletion: DeleteKeepOut,
    ) -> Later<'a, Result<KeepOutAnswer, ServiceError>>;

    /// What became of the last scans.
    fn list_events<'a>(
        &'a self,
        call: &'a ForwardedCall,
        query: EventsQuery,
    ) -> Later<'a, Result<Vec<Arc<ScanEvent>>, ServiceError>>;

    /// The same, and then each event as it comes.
    fn watch_events<'a>(
        &'a self,
        call: &'a ForwardedCall,
        query: EventsQuery,
    ) -> Later<'a, Result<ForwardedEvents, ServiceError>>;

    /// Where and when each robot was last seen, of the map's description.
    fn sightings<'a>(&'a self, call: &'a ForwardedCall) -> Later<'a, Result<Vec<Sighting>, ServiceError>>;
}
