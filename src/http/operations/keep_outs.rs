//! `/v1/maps/{map}/keep-outs`: list, put and remove keep-outs.

use axum::response::{Json, Response};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::http::error::HttpError;
use crate::http::forms::Object;
use crate::http::forms::body;
use crate::http::forms::{BoxBody, OrientedBoxBody, PrismBody, SphereBody};
use crate::http::forms::{KeepOutOfMap, Map, NoParams, Params, request_id_of};
use crate::http::middleware::Service;
use crate::http::pieces;
use crate::json::described;
use crate::json::{JsonKeepOut, JsonVersion};
use mrol_map::map::{KeepOutName, KeepOutShape, Region};
use mrol_service::{DeleteKeepOut, KeepOutAnswer, KeepOutList, PutKeepOut, Reason, ServiceError};

/// A keep-out: exactly one of its shapes.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({"sphere": {"center_m": [1, 1, 0], "radius_m": 0.5}}))]
pub(crate) struct KeepOutBody {
    /// A box along the map's axes.
    #[schema(value_type = Option<BoxBody>)]
    r#box: Option<Object<BoxBody>>,
    /// A ball.
    #[schema(value_type = Option<SphereBody>)]
    sphere: Option<Object<SphereBody>>,
    /// A box with any orientation.
    #[schema(value_type = Option<OrientedBoxBody>)]
    oriented_box: Option<Object<OrientedBoxBody>>,
    /// A polygon with a height.
    #[schema(value_type = Option<PrismBody>)]
    prism: Option<Object<PrismBody>>,
    /// When the server ends it, nanoseconds since the Unix epoch; never without.
    expires_at_ns: Option<i64>,
    /// The caller's own id of this change: sent again, it changes nothing.
    #[schema(value_type = Option<described::RequestId>)]
    request_id: Option<String>,
}

/// The parameters of the removal of a keep-out.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct RemovalParams {
    /// The caller's own id of this change: sent again, it changes nothing.
    #[param(value_type = Option<described::RequestId>, inline)]
    request_id: Option<String>,
}

/// What a change of a keep-out made.
#[derive(Serialize, ToSchema)]
pub(crate) struct KeepOutResponse {
    /// True of a request that was answered before: this is that answer.
    replayed: bool,
    #[serde(flatten)]
    version: JsonVersion,
}

/// The keep-outs of a map.
#[derive(Serialize, ToSchema)]
pub(crate) struct KeepOutsResponse {
    /// The keep-outs, by name.
    keep_outs: Vec<JsonKeepOut>,
    #[serde(flatten)]
    version: JsonVersion,
}

/// About as many bytes as a keep-out takes as JSON.
const BYTES_PER_KEEP_OUT: usize = 512;

/// Lists the keep-outs of a map.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/keep-outs",
    responses((status = 200, description = "Answered", body = KeepOutsResponse))
)]
pub(crate) async fn list(
    Service(service): Service,
    Map(map): Map,
    NoParams: NoParams,
) -> Result<Response, HttpError> {
    let listing = service.list_keep_outs(&map).await?;
    let bytes = listing.keep_outs.len() * BYTES_PER_KEEP_OUT;
    pieces::whole(&service, bytes, move || KeepOutsResponse::from(listing)).await
}

/// Puts a keep-out: a part of space where no robot may go, whatever the map holds there.
///
/// It takes the place of the one of its name.
#[utoipa::path(
    put,
    path = "/v1/maps/{map}/keep-outs/{name}",
    request_body = KeepOutBody,
    responses((status = 200, description = "Answered", body = KeepOutResponse))
)]
pub(crate) async fn put(
    Service(service): Service,
    KeepOutOfMap(map, name): KeepOutOfMap,
    body::Json(keep_out): body::Json<KeepOutBody>,
) -> Result<Json<KeepOutResponse>, HttpError> {
    let answer = service.put_keep_out(&map, keep_out.named(name)?).await?;
    Ok(Json(answer.into()))
}

/// Removes a keep-out.
#[utoipa::path(
    delete,
    path = "/v1/maps/{map}/keep-outs/{name}",
    params(RemovalParams),
    responses((status = 200, description = "Answered", body = KeepOutResponse))
)]
pub(crate) async fn delete(
    Service(service): Service,
    KeepOutOfMap(map, name): KeepOutOfMap,
    Params(RemovalParams { request_id }): Params<RemovalParams>,
) -> Result<Json<KeepOutResponse>, HttpError> {
    let deletion = DeleteKeepOut { name, request_id: request_id_of(request_id)? };
    let answer = service.delete_keep_out(&map, deletion).await?;
    Ok(Json(answer.into()))
}

impl KeepOutBody {
    fn named(self, name: KeepOutName) -> Result<PutKeepOut, ServiceError> {
        let of_region = |region: Region| Ok::<_, ServiceError>(KeepOutShape::of_region(region)?);
        let shape = match (self.r#box, self.sphere, self.oriented_box, self.prism) {
            (Some(Object(body)), None, None, None) => of_region(body.try_into()?)?,
            (None, Some(Object(body)), None, None) => of_region(body.try_into()?)?,
            (None, None, Some(Object(body)), None) => of_region(body.try_into()?)?,
            (None, None, None, Some(Object(body))) => KeepOutShape::Prism(body.try_into()?),
            _ => {
                let message = "exactly one of box, sphere, oriented_box and prism must be given";
                return Err(ServiceError::new(Reason::AmbiguousTarget, message));
            }
        };
        let request_id = request_id_of(self.request_id)?;
        Ok(PutKeepOut { name, shape, expires_at_ns: self.expires_at_ns, request_id })
    }
}

impl From<KeepOutAnswer> for KeepOutResponse {
    fn from(KeepOutAnswer { version, replayed }: KeepOutAnswer) -> Self {
        Self { replayed, version: version.into() }
    }
}

impl From<KeepOutList> for KeepOutsResponse {
    fn from(KeepOutList { keep_outs, version }: KeepOutList) -> Self {
        Self { keep_outs: keep_outs.iter().map(Into::into).collect(), version: version.into() }
    }
}
