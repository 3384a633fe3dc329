//! `/v1/maps/{map}/keep-outs`: list, put and remove keep-outs.

use axum::response::Json;
use serde::{Deserialize, Serialize};

use super::body;
use super::error::HttpError;
use super::middleware::Service;
use super::object::Object;
use super::params::{KeepOutOfMap, Map, NoParams, Params, request_id_of};
use super::shapes::{BoxBody, OrientedBoxBody, PrismBody, SphereBody};
use crate::map::{KeepOutName, KeepOutShape, Region};
use crate::service::{DeleteKeepOut, KeepOutAnswer, KeepOutList, PutKeepOut, Reason, ServiceError};
use crate::wire::json::{JsonKeepOut, JsonVersion};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct KeepOutBody {
    r#box: Option<Object<BoxBody>>,
    sphere: Option<Object<SphereBody>>,
    oriented_box: Option<Object<OrientedBoxBody>>,
    prism: Option<Object<PrismBody>>,
    expires_at_ns: Option<i64>,
    request_id: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RemovalParams {
    request_id: Option<String>,
}

#[derive(Serialize)]
pub(super) struct KeepOutResponse {
    replayed: bool,
    #[serde(flatten)]
    version: JsonVersion,
}

#[derive(Serialize)]
pub(super) struct KeepOutsResponse {
    keep_outs: Vec<JsonKeepOut>,
    #[serde(flatten)]
    version: JsonVersion,
}

pub(super) async fn list(
    Service(service): Service,
    Map(map): Map,
    NoParams: NoParams,
) -> Result<Json<KeepOutsResponse>, HttpError> {
    let listing = service.list_keep_outs(&map).await?;
    Ok(Json(listing.into()))
}

pub(super) async fn put(
    Service(service): Service,
    KeepOutOfMap(map, name): KeepOutOfMap,
    body::Json(keep_out): body::Json<KeepOutBody>,
) -> Result<Json<KeepOutResponse>, HttpError> {
    let answer = service.put_keep_out(&map, keep_out.named(name)?).await?;
    Ok(Json(answer.into()))
}

pub(super) async fn delete(
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
