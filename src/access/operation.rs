//! Every operation of the server, once: its name, its place in each protocol, and the scope that it takes.
//!
//! Both protocols look a request up here before anything else is done with it. What is not in the table is not
//! answered, so nothing can be served without a rule.

use super::scope::Scope;
use super::scope::Scope::{Admin, Insert, Read, Write};

/// Where HTTP has an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Route {
    /// The method. What answers `GET` answers `HEAD`, too.
    pub method: &'static str,
    /// The path, with `{map}` where the map's name stands.
    pub path: &'static str,
}

struct Row {
    name: &'static str,
    scope: Option<Scope>,
    grpc: Option<&'static str>,
    route: Option<Route>,
}

/// Makes [`Operation`] and its rows from one table.
macro_rules! operations {
    ($($name:ident: $scope:expr $(, grpc $grpc:literal)? $(, http $method:ident $path:literal)?;)+) => {
        /// What a caller can ask for.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Operation {
            $(
                $(#[doc = concat!("gRPC `", $grpc, "`.")])?
                $(#[doc = concat!("HTTP `", stringify!($method), " ", $path, "`.")])?
                $name,
            )+
        }

        impl Operation {
            /// All operations.
            pub const ALL: &[Self] = &[$(Self::$name),+];

            fn row(self) -> Row {
                match self {
                    $(Self::$name => Row {
                        name: stringify!($name),
                        scope: $scope,
                        grpc: [$($grpc)?].first().copied(),
                        route: [$(Route { method: stringify!($method), path: $path })?].first().copied(),
                    },)+
                }
            }
        }
    };
}

// A scope of `None` asks for no key. Of undo, `Insert` covers that of named robots' scans: the service asks for the
// rest.
operations! {
    QueryPoints:       Some(Read),  grpc "/mrol.v1.Occupancy/QueryPoints",       http POST "/v1/maps/{map}/occupancy";
    QueryPointsStream: Some(Read),  grpc "/mrol.v1.Occupancy/QueryPointsStream";
    ListVoxels:        Some(Read),  grpc "/mrol.v1.Occupancy/ListVoxels",        http GET "/v1/maps/{map}/voxels";
    CheckPoses:        Some(Read),  grpc "/mrol.v1.Occupancy/CheckPoses",        http POST "/v1/maps/{map}/poses";
    CheckPosesStream:  Some(Read),  grpc "/mrol.v1.Occupancy/CheckPosesStream";
    CheckSpheres:      Some(Read),  grpc "/mrol.v1.Occupancy/CheckSpheres",      http POST "/v1/maps/{map}/spheres";
    CheckSpheresStream: Some(Read), grpc "/mrol.v1.Occupancy/CheckSpheresStream";
    CheckMotions:      Some(Read),  grpc "/mrol.v1.Occupancy/CheckMotions",      http POST "/v1/maps/{map}/motions";
    CheckMotionsStream: Some(Read), grpc "/mrol.v1.Occupancy/CheckMotionsStream";
    CastRays:          Some(Read),  grpc "/mrol.v1.Occupancy/CastRays",          http POST "/v1/maps/{map}/rays";
    CastRaysStream:    Some(Read),  grpc "/mrol.v1.Occupancy/CastRaysStream";
    FindNearest:       Some(Read),  grpc "/mrol.v1.Occupancy/FindNearest",       http POST "/v1/maps/{map}/nearest";
    FindNearestStream: Some(Read),  grpc "/mrol.v1.Occupancy/FindNearestStream";
    ClassifyPoints:    Some(Read),  grpc "/mrol.v1.Occupancy/ClassifyPoints",    http POST "/v1/maps/{map}/classification";
    ClassifyPointsStream: Some(Read), grpc "/mrol.v1.Occupancy/ClassifyPointsStream";
    ListFrontiers:     Some(Read),  grpc "/mrol.v1.Occupancy/ListFrontiers",     http POST "/v1/maps/{map}/frontiers";
    ProjectGrid:       Some(Read),  grpc "/mrol.v1.Occupancy/ProjectGrid",       http POST "/v1/maps/{map}/grid";
    StreamGrid:        Some(Read),  grpc "/mrol.v1.Occupancy/StreamGrid",        http POST "/v1/maps/{map}/grid/tiles";
    ListKeepOuts:      Some(Read),  grpc "/mrol.v1.Occupancy/ListKeepOuts",      http GET "/v1/maps/{map}/keep-outs";
    GetBlock:          Some(Read),  grpc "/mrol.v1.Occupancy/GetBlock",          http GET "/v1/maps/{map}/block";
    ListObservers:     Some(Read),  grpc "/mrol.v1.Occupancy/ListObservers",     http GET "/v1/maps/{map}/observers";
    Watch:             Some(Read),  grpc "/mrol.v1.Occupancy/Watch",             http GET "/v1/maps/{map}/watch";
    InsertScan:        Some(Insert), grpc "/mrol.v1.Mapping/InsertScan",          http POST "/v1/maps/{map}/scans";
    InsertScanStream:  Some(Insert), grpc "/mrol.v1.Mapping/InsertScanStream";
    AlignScan:         Some(Read),  grpc "/mrol.v1.Mapping/AlignScan",           http POST "/v1/maps/{map}/alignment";
    Localize:          Some(Read),  grpc "/mrol.v1.Mapping/Localize",            http POST "/v1/maps/{map}/localize";
    DeleteVoxels:      Some(Write), grpc "/mrol.v1.Mapping/DeleteVoxels",        http POST "/v1/maps/{map}/deletions";
    Undo:         Some(Insert), grpc "/mrol.v1.Mapping/Undo",           http POST "/v1/maps/{map}/undo";
    PutKeepOut:        Some(Write), grpc "/mrol.v1.Mapping/PutKeepOut",          http PUT "/v1/maps/{map}/keep-outs/{name}";
    DeleteKeepOut:     Some(Write), grpc "/mrol.v1.Mapping/DeleteKeepOut",       http DELETE "/v1/maps/{map}/keep-outs/{name}";
    GetTrajectory:     Some(Read),  grpc "/mrol.v1.Mapping/GetTrajectory",       http GET "/v1/maps/{map}/trajectory";
    StreamTrajectory:  Some(Read),  grpc "/mrol.v1.Mapping/StreamTrajectory";
    ListEvents:        Some(Read),  grpc "/mrol.v1.Mapping/ListEvents",          http GET "/v1/maps/{map}/events";
    WatchEvents:       Some(Read),  grpc "/mrol.v1.Mapping/WatchEvents",         http GET "/v1/maps/{map}/events/watch";
    CreateMap:         Some(Admin), grpc "/mrol.v1.Maps/CreateMap",              http PUT "/v1/maps/{map}";
    GetMap:            Some(Read),  grpc "/mrol.v1.Maps/GetMap",                 http GET "/v1/maps/{map}";
    ListMaps:          Some(Read),  grpc "/mrol.v1.Maps/ListMaps",               http GET "/v1/maps";
    RenameMap:         Some(Admin), grpc "/mrol.v1.Maps/RenameMap",              http POST "/v1/maps/{map}/rename";
    DeleteMap:         Some(Admin), grpc "/mrol.v1.Maps/DeleteMap",              http DELETE "/v1/maps/{map}";
    SnapshotMap:       Some(Read),  grpc "/mrol.v1.Maps/SnapshotMap",            http GET "/v1/maps/{map}/snapshot";
    RestoreMap:        Some(Admin), grpc "/mrol.v1.Maps/RestoreMap",             http PUT "/v1/maps/{map}/snapshot";
    Reflect:           Some(Read),  grpc "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo";
    HealthCheck:       None,        grpc "/grpc.health.v1.Health/Check";
    HealthWatch:       None,        grpc "/grpc.health.v1.Health/Watch";
    ShowViewer:        None,        http GET "/";
    GetViewerFile:     None,        http GET "/viewer/{file}";
    Live:              None,        http GET "/livez";
    Ready:             None,        http GET "/readyz";
    Metrics:           Some(Read),  http GET "/metrics";
    DescribeApi:       None,        http GET "/openapi.json";
    ReadApi:           None,        http GET "/docs";
    ReadApiFile:       None,        http GET "/docs/{asset}";
}

impl Operation {
    /// The operation's name in metrics and the log, the same in both protocols.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// The least scope of a key that may ask for it; none where no key is needed.
    pub fn scope(self) -> Option<Scope> {
        self.row().scope
    }

    /// True for what changes maps.
    pub fn is_change(self) -> bool {
        self.scope().is_some_and(|scope| scope > Read)
    }

    /// True for what a node of a cluster asks of the one that leads, for callers of its own.
    pub fn is_asked_by_nodes(self) -> bool {
        matches!(
            self,
            Self::InsertScan
                | Self::DeleteVoxels
                | Self::Undo
                | Self::PutKeepOut
                | Self::DeleteKeepOut
                | Self::ListEvents
                | Self::WatchEvents
                | Self::GetMap
        )
    }

    /// The path of the gRPC call.
    pub fn grpc(self) -> Option<&'static str> {
        self.row().grpc
    }

    /// Where HTTP has it.
    pub fn route(self) -> Option<Route> {
        self.row().route
    }

    /// True for what orchestrators ask: answered while the server is going down, too.
    pub fn is_probe(self) -> bool {
        matches!(self, Self::HealthCheck | Self::HealthWatch | Self::Live | Self::Ready | Self::Metrics)
    }

    /// True for calls that last as long as their client wishes.
    pub fn is_stream(self) -> bool {
        matches!(
            self,
            Self::QueryPointsStream
                | Self::CheckPosesStream
                | Self::CheckSpheresStream
                | Self::CheckMotionsStream
                | Self::CastRaysStream
                | Self::FindNearestStream
                | Self::ClassifyPointsStream
                | Self::InsertScanStream
                | Self::Watch
                | Self::WatchEvents
                | Self::Reflect
                | Self::HealthWatch
        )
    }

    /// True for watches of a map.
    pub fn is_watch(self) -> bool {
        matches!(self, Self::Watch | Self::WatchEvents)
    }

    /// True for streams whose messages are requests of their own, each counted when it is answered.
    pub fn is_stream_of_requests(self) -> bool {
        self.is_stream() && !self.is_watch() && !matches!(self, Self::Reflect | Self::HealthWatch)
    }

    /// The operation of a gRPC call.
    pub fn of_call(path: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|operation| operation.grpc() == Some(path))
    }

    /// The operation of an HTTP request to the route `path`.
    pub fn of_request(method: &str, path: &str) -> Option<Self> {
        let method = if method == "HEAD" { "GET" } else { method };
        let asked = |route: Route| route.method == method && route.path == path;
        Self::ALL.iter().copied().find(|operation| operation.route().is_some_and(asked))
    }

    /// The methods that the route `path` takes.
    pub fn methods_of(path: &str) -> impl Iterator<Item = &'static str> {
        let at = move |route: &Route| route.path == path;
        Self::ALL.iter().filter_map(|operation| operation.route()).filter(at).map(|route| route.method)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_and_a_request_of_the_same_meaning_are_one_operation() {
        let call = Operation::of_call("/mrol.v1.Mapping/Localize");
        assert_eq!(call, Some(Operation::Localize));
        assert_eq!(call, Operation::of_request("POST", "/v1/maps/{map}/localize"));
        assert_eq!(Operation::of_request("HEAD", "/v1/maps"), Some(Operation::ListMaps));
    }

    #[test]
    fn what_is_not_in_the_table_is_no_operation() {
        for call in ["/mrol.v1.Maps/Other", "/mrol.v2.Maps/GetMap", "/", ""] {
            assert_eq!(Operation::of_call(call), None);
        }
        assert_eq!(Operation::of_request("PATCH", "/v1/maps/{map}"), None);
        assert_eq!(Operation::methods_of("/v1/maps/{map}").collect::<Vec<_>>(), ["PUT", "GET", "DELETE"]);
    }
}
