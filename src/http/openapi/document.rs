//! The description of the interface as one document.

use std::sync::LazyLock;

use utoipa::OpenApi;
use utoipa::openapi::security::{Http, HttpAuthScheme, SecurityScheme};

use super::from_table::KEY;
use super::{failures, from_table, optional_parts};
use crate::http::error::Problem;
use crate::http::routes;
use mrol_service::{Reason, ServiceError};

/// What is said of the interface as a whole.
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
    components(schemas(Problem))
)]
struct Interface;

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
    let mut described = Interface::openapi();
    described.merge(routes::Described::openapi());
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
