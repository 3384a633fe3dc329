//! Which handler answers which operation.

use axum::Router;
use axum::http::Method;
use axum::routing::{MethodFilter, MethodRouter, on};

use super::adapter::Adapter;
use super::operations::{
    block, deletions, events, keep_outs, localization, map_file, maps, observers, occupancy, scans,
    trajectory, undo, voxels, watch,
};
use super::{openapi, probes, question, reader, viewer};
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
        Operation::CheckPoses => on(method, question::poses::check_poses),
        Operation::CheckSpheres => on(method, question::spheres::check_spheres),
        Operation::CheckMotions => on(method, question::motions::check_motions),
        Operation::CastRays => on(method, question::rays::cast_rays),
        Operation::FindNearest => on(method, question::nearest::find_nearest),
        Operation::ClassifyPoints => on(method, question::classify::classify_points),
        Operation::ListFrontiers => on(method, question::frontiers::list_frontiers),
        Operation::ProjectGrid => on(method, question::grid::project_grid),
        Operation::StreamGrid => on(method, question::grid::stream_grid),
        Operation::DeleteVoxels => on(method, deletions::delete),
        Operation::Undo => on(method, undo::undo),
        Operation::GetTrajectory => on(method, trajectory::get),
        Operation::ListVoxels => on(method, voxels::list),
        Operation::GetBlock => on(method, block::get),
        Operation::ListObservers => on(method, observers::list),
        Operation::Watch => on(method, watch::watch),
        Operation::ListEvents => on(method, events::list),
        Operation::WatchEvents => on(method, events::watch),
        Operation::ListKeepOuts => on(method, keep_outs::list),
        Operation::PutKeepOut => on(method, keep_outs::put),
        Operation::DeleteKeepOut => on(method, keep_outs::delete),
        Operation::SnapshotMap => on(method, map_file::take),
        Operation::RestoreMap => on(method, map_file::restore),
        Operation::ShowViewer => on(method, viewer::pages::index),
        Operation::GetViewerFile => on(method, viewer::pages::file),
        Operation::Live => on(method, probes::live),
        Operation::Ready => on(method, probes::ready),
        Operation::Metrics => on(method, probes::metrics),
        Operation::DescribeApi => on(method, openapi::describe),
        Operation::ReadApi => on(method, reader::page::page),
        Operation::ReadApiFile => on(method, reader::page::file),
        Operation::QueryPointsStream
        | Operation::CheckPosesStream
        | Operation::CheckSpheresStream
        | Operation::CheckMotionsStream
        | Operation::CastRaysStream
        | Operation::FindNearestStream
        | Operation::ClassifyPointsStream
        | Operation::InsertScanStream
        | Operation::StreamTrajectory
        | Operation::Reflect
        | Operation::HealthCheck
        | Operation::HealthWatch => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::{Access, Gate};
    use crate::admission::{Admission, Lifecycle};
    use crate::http::middleware::Http;
    use crate::middleware::Middleware;
    use crate::telemetry::{Audit, Metrics, RequestRecorder};
    use axum::body::{Body, to_bytes};
    use axum::http::{Request, StatusCode};
    use axum::routing::get;
    use mrol_service::{Limits, MapService, ServiceSettings};
    use mrol_store::OpeningProgress;
    use tower::ServiceExt;

    #[tokio::test]
    async fn what_somebody_serves_without_a_rule_is_refused_as_a_defect() {
        let service = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        let gate = Gate::new(Access::open(), service);
        let admission = Admission::new(&Limits::default(), Lifecycle::default());
        let recorder = RequestRecorder::new(Metrics::new().unwrap(), Audit::default());
        let stray = Router::new().route("/stray", get(async || "open to all"));
        let stray = Middleware::new(gate, admission, recorder).wrap(Http, stray);
        let answer = stray
            .oneshot(Request::get("/stray").header("host", "localhost").body(Body::empty()).unwrap())
            .await
            .unwrap();
        assert_eq!(answer.status(), StatusCode::INTERNAL_SERVER_ERROR);
        let said = to_bytes(answer.into_body(), 1000).await.unwrap();
        assert!(String::from_utf8_lossy(&said).contains("no_rule"), "{said:?}");
    }
}
