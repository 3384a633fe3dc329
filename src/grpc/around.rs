//! What happens around every call: its span, its deadline, the refusal while draining, its count.

use std::time::Instant;

use axum::Router;
use axum::extract::{Request, State};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::Response;
use tonic::{Code, Status};
use tracing::Instrument;

use super::{Adapter, deadline, status};

/// Calls whose requests are counted one by one where they are answered, and not here.
const STREAMS: [&str; 2] = ["QueryPointsStream", "InsertScanStream"];

/// Wraps the services' routes.
pub(super) fn routes(routes: Router, adapter: &Adapter) -> Router {
    routes.layer(from_fn_with_state(adapter.clone(), call))
}

async fn call(State(adapter): State<Adapter>, request: Request, next: Next) -> Response {
    let (start, operation) = (Instant::now(), operation(request.uri().path()));
    let deadline = deadline::of(request.headers());
    let span = tracing::info_span!("grpc", operation);
    let answer = deadline::within(deadline, next.run(request)).instrument(span);
    let response = match adapter.lifecycle.admit(answer).await {
        Ok(Ok(response)) => response,
        Ok(Err(refusal)) | Err(refusal) => Status::from(refusal).into_http(),
    };
    let code = code(&response);
    if code != Code::Ok || !STREAMS.contains(&operation) {
        adapter.service.metrics().request("grpc", operation, status::label(code), start.elapsed());
    }
    tracing::debug!(operation, code = status::label(code), elapsed = ?start.elapsed(), "grpc call");
    response
}

/// The code of a call that failed; one that did not has none in its headers.
fn code(response: &Response) -> Code {
    response.headers().get("grpc-status").map_or(Code::Ok, |value| Code::from_bytes(value.as_bytes()))
}

/// The name of a call for metrics and the log. Whatever a client may send, it is one of few.
fn operation(path: &str) -> &'static str {
    const OPERATIONS: [&str; 15] = [
        "Occupancy/QueryPoints",
        "Occupancy/QueryPointsStream",
        "Occupancy/ListVoxels",
        "Mapping/InsertScan",
        "Mapping/InsertScanStream",
        "Mapping/AlignScan",
        "Mapping/DeleteVoxels",
        "Mapping/UndoScans",
        "Mapping/GetTrajectory",
        "Maps/CreateMap",
        "Maps/GetMap",
        "Maps/ListMaps",
        "Maps/DeleteMap",
        "Maps/SnapshotMap",
        "Maps/RestoreMap",
    ];
    let called = path.strip_prefix("/mrol.v1.").unwrap_or_default();
    let known = OPERATIONS.into_iter().find(|operation| *operation == called);
    known.and_then(|operation| operation.split('/').next_back()).unwrap_or("unknown")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operation_is_a_call_of_the_contract_or_unknown() {
        assert_eq!(operation("/mrol.v1.Maps/GetMap"), "GetMap");
        for other in ["/mrol.v1.Maps/Other", "/mrol.v2.Maps/GetMap", "/", ""] {
            assert_eq!(operation(other), "unknown");
        }
    }
}
