//! Which handler answers which operation.

use axum::Router;
use axum::http::Method;
use axum::routing::{MethodFilter, MethodRouter, on};

use super::{Adapter, deletions, localization, maps, occupancy, probes, scans, trajectory, undo, voxels};
use crate::access::Operation;

/// A route for every operation that HTTP has, and none besides.
pub(super) fn of_operations() -> Router<Adapter> {
    let served = Operation::ALL.iter().filter_map(|&operation| served(operation));
    served.fold(Router::new(), |router, (path, handler)| router.route(path, handler))
}

/// The path of an operation and what answers there.
fn served(operation: Operation) -> Option<(&'static str, MethodRouter<Adapter>)> {
    let route = operation.route()?;
    let method = MethodFilter::try_from(route.method.parse::<Method>().ok()?).ok()?;
    Some((route.path, handler(operation, method)?))
}

/// What answers an operation by HTTP. There is no other place where a handler comes to be served, and an operation
/// that is not decided upon here does not compile.
fn handler(operation: Operation, method: MethodFilter) -> Option<MethodRouter<Adapter>> {
    Some(match operation {
        Operation::ListMaps => on(method, maps::list),
        Operation::CreateMap => on(method, maps::create),
        Operation::GetMap => on(method, maps::describe),
        Operation::DeleteMap => on(method, maps::delete),
        Operation::InsertScan => on(method, scans::insert),
        Operation::AlignScan => on(method, scans::align),
        Operation::Localize => on(method, localization::localize),
        Operation::QueryPoints => on(method, occupancy::query),
        Operation::DeleteVoxels => on(method, deletions::delete),
        Operation::UndoScans => on(method, undo::undo),
        Operation::GetTrajectory => on(method, trajectory::get),
        Operation::ListVoxels => on(method, voxels::list),
        Operation::Live => on(method, probes::live),
        Operation::Ready => on(method, probes::ready),
        Operation::Metrics => on(method, probes::metrics),
        Operation::QueryPointsStream
        | Operation::InsertScanStream
        | Operation::SnapshotMap
        | Operation::RestoreMap
        | Operation::Reflect
        | Operation::HealthCheck
        | Operation::HealthWatch => return None,
    })
}
