//! Which handler answers which operation: the one list of handlers.

use axum::Router;
use axum::http::Method;
use axum::routing::{MethodFilter, MethodRouter, on};
use utoipa::OpenApi;

use super::adapter::Adapter;
use super::operations::{
    block, deletions, events, keep_outs, localization, map_file, maps, observers, occupancy, scans,
    trajectory, undo, voxels, watch,
};
use super::{probes, question, reader, viewer};
use crate::access::Operation;

/// A route for every operation that HTTP has, and none besides.
pub(super) fn of_operations() -> Router<Adapter> {
    let served = Operation::ALL.iter().filter_map(|&operation| served(operation));
    served.fold(Router::new(), |router, (path, handler)| router.route(path, handler))
}

/// A route for each of what orchestrators and Prometheus ask, and none besides.
pub(super) fn of_probes() -> Router<Adapter> {
    let probes = [Operation::Live, Operation::Ready, Operation::Metrics].into_iter().filter_map(served);
    probes.fold(Router::new(), |router, (path, handler)| router.route(path, handler))
}

/// The path of an operation and what answers there.
fn served(operation: Operation) -> Option<(&'static str, MethodRouter<Adapter>)> {
    let route = operation.route()?;
    let method = MethodFilter::try_from(route.method.parse::<Method>().ok()?).ok()?;
    Some((route.path, handler(operation, method)?))
}

/// Makes, from one list, what answers each operation, and the description of all of them.
macro_rules! handlers {
    (
        over HTTP { $($operation:ident => $($part:ident)::+;)+ }
        over gRPC alone { $($other:ident),+ }
    ) => {
        /// What answers an operation by HTTP. There is no other place where a handler comes to be served, and an
        /// operation that is not decided upon here does not compile.
        fn handler(operation: Operation, method: MethodFilter) -> Option<MethodRouter<Adapter>> {
            Some(match operation {
                $(Operation::$operation => on(method, $($part)::+),)+
                $(Operation::$other)|+ => return None,
            })
        }

        /// What the attributes of the handlers say of them.
        #[derive(OpenApi)]
        #[openapi(paths($($($part)::+),+))]
        pub(super) struct Described;
    };
}

handlers! {
    over HTTP {
        ListMaps => maps::list;
        CreateMap => maps::create;
        GetMap => maps::describe;
        RenameMap => maps::rename;
        DeleteMap => maps::delete;
        SnapshotMap => map_file::take;
        RestoreMap => map_file::restore;
        InsertScan => scans::insert;
        AlignScan => scans::align;
        Localize => localization::localize;
        DeleteVoxels => deletions::delete;
        Undo => undo::undo;
        GetTrajectory => trajectory::get;
        ListEvents => events::list;
        WatchEvents => events::watch;
        ListKeepOuts => keep_outs::list;
        PutKeepOut => keep_outs::put;
        DeleteKeepOut => keep_outs::delete;
        QueryPoints => occupancy::query;
        CheckPoses => question::poses::check_poses;
        CheckSpheres => question::spheres::check_spheres;
        CheckMotions => question::motions::check_motions;
        CastRays => question::rays::cast_rays;
        FindNearest => question::nearest::find_nearest;
        ClassifyPoints => question::classify::classify_points;
        ListFrontiers => question::frontiers::list_frontiers;
        ProjectGrid => question::grid::project_grid;
        StreamGrid => question::grid::stream_grid;
        ListVoxels => voxels::list;
        GetBlock => block::get;
        ListObservers => observers::list;
        Watch => watch::watch;
        Live => probes::live;
        Ready => probes::ready;
        Metrics => probes::metrics;
        ShowViewer => viewer::pages::index;
        GetViewerFile => viewer::pages::file;
        DescribeApi => reader::description::describe;
        ReadApi => reader::page::page;
        ReadApiFile => reader::page::file;
    }
    over gRPC alone {
        QueryPointsStream, CheckPosesStream, CheckSpheresStream, CheckMotionsStream, CastRaysStream,
        FindNearestStream, ClassifyPointsStream, InsertScanStream, StreamTrajectory, Reflect, HealthCheck,
        HealthWatch
    }
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
