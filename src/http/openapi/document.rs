//! The description of the interface as one document.

use std::sync::LazyLock;

use axum::http::header;
use axum::response::IntoResponse;
use utoipa::OpenApi;
use utoipa::openapi::security::{Http, HttpAuthScheme, SecurityScheme};

use super::from_table::KEY;
use super::{failures, from_table, optional_parts};
use crate::http::error::{HttpError, Problem};
use crate::http::forms::NoParams;
use crate::http::operations::{
    block, deletions, events, keep_outs, localization, map_file, maps, observers, occupancy, scans,
    trajectory, undo, voxels, watch,
};
use crate::http::{probes, question, reader, viewer};
use mrol_service::{Reason, ServiceError};

/// What the attributes of the handlers say.
#[derive(OpenApi)]
#[openapi(
    info(title = "MROL map server", description = include_str!("introduction.md")),
    servers((url = "./", description = "This server")),
    tags(
        (name = "Maps", description = "Make, describe, save and delete maps"),
        (name = "Mapping", description = "Insert scans, localize, delete, undo, keep-outs"),
        (name = "Occupancy", description = "Ask about a map, and watch it"),
        (name = "Server", description = "Health, metrics and this description")
    ),
    paths(
        maps::list,
        maps::create,
        maps::describe,
        maps::delete,
        map_file::take,
        map_file::restore,
        scans::insert,
        scans::align,
        localization::localize,
        deletions::delete,
        undo::undo,
        trajectory::get,
        events::list,
        events::watch,
        keep_outs::list,
        keep_outs::put,
        keep_outs::delete,
        occupancy::query,
        question::poses::check_poses,
        question::spheres::check_spheres,
        question::motions::check_motions,
        question::rays::cast_rays,
        question::nearest::find_nearest,
        question::classify::classify_points,
        question::frontiers::list_frontiers,
        question::grid::project_grid,
        question::grid::stream_grid,
        voxels::list,
        block::get,
        observers::list,
        watch::watch,
        probes::live,
        probes::ready,
        probes::metrics,
        viewer::pages::index,
        viewer::pages::file,
        describe,
        reader::page::page,
        reader::page::file
    ),
    components(schemas(Problem))
)]
struct OfHandlers;

/// The description of the HTTP interface, as JSON.
pub fn openapi_json() -> Result<&'static str, ServiceError> {
    static DESCRIPTION: LazyLock<Result<String, ServiceError>> = LazyLock::new(|| {
        let json = serde_json::to_string(&described());
        let json = json.map_err(|error| ServiceError::new(Reason::NotWritten, error.to_string()))?;
        // The registry of formats knows them without the hyphen.
        Ok(json.replace("\"format\":\"u-int", "\"format\":\"uint"))
    });
    DESCRIPTION.as_deref().map_err(Clone::clone)
}

/// What the attributes say, and what is filled in.
fn described() -> utoipa::openapi::OpenApi {
    let mut described = OfHandlers::openapi();
    from_table::fill_in(&mut described.paths);
    let components = described.components.get_or_insert_default();
    components.responses.extend(failures::responses());
    components.schemas.values_mut().for_each(optional_parts::mend);
    let mut bearer = Http::new(HttpAuthScheme::Bearer);
    bearer.description =
        Some("A key of the server, where it asks for keys: `mrol key new` makes one.".into());
    components.security_schemes.insert(KEY.into(), SecurityScheme::Http(bearer).into());
    described
}

/// Describes the HTTP interface: this document.
#[utoipa::path(
    get,
    path = "/openapi.json",
    responses((status = 200, description = "OpenAPI 3.1", body = Object, content_type = "application/json"))
)]
pub(crate) async fn describe(NoParams: NoParams) -> Result<impl IntoResponse, HttpError> {
    let headers = [(header::CONTENT_TYPE, "application/json"), (header::X_CONTENT_TYPE_OPTIONS, "nosniff")];
    Ok((headers, openapi_json()?))
}
