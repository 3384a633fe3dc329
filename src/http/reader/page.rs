//! Answers that are files of the reader.

use std::sync::{Arc, LazyLock};

use axum::body::Bytes;
use axum::extract::Path;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use utoipa_swagger_ui::{Config, SwaggerFile};

use crate::http::error::HttpError;
use crate::http::forms::NoParams;
use mrol_map::util::excerpt;
use mrol_service::{Reason, ServiceError};

/// The files of the page.
pub(crate) const FILES: [&str; 3] = ["swagger-ui.css", "swagger-ui-bundle.js", START];
const START: &str = "start.js";

/// What the page may load and do. Swagger UI sets styles of its elements, and draws with images that are in its own
/// files.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; \
     img-src 'self' data:; connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'";

/// Shows this description, and sends requests from it.
#[utoipa::path(
    get,
    path = "/docs",
    responses((status = 200, description = "A page", body = String, content_type = "text/html; charset=utf-8"))
)]
pub(crate) async fn page(NoParams: NoParams) -> Response {
    (guarded("text/html; charset=utf-8"), include_str!("page.html")).into_response()
}

/// Gives out a file of the page at `/docs`.
#[utoipa::path(
    get,
    path = "/docs/{asset}",
    responses((
        status = 200,
        description = "The file",
        content((String = "text/css"), (String = "text/javascript"))
    ))
)]
pub(crate) async fn file(Path(file): Path<String>, NoParams: NoParams) -> Result<Response, HttpError> {
    if !FILES.contains(&file.as_str()) {
        let message = format!("no route /docs/{}", excerpt(&file));
        return Err(ServiceError::new(Reason::RouteNotFound, message).into());
    }
    if file == START {
        return Ok((guarded("text/javascript"), include_str!("start.js")).into_response());
    }
    let SwaggerFile { bytes, content_type, gzpipped, .. } = swagger_file(&file)?;
    let mut headers = guarded(&content_type);
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("max-age=3600"));
    if gzpipped {
        headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    Ok((headers, Bytes::from(bytes.into_owned())).into_response())
}

fn swagger_file(name: &str) -> Result<SwaggerFile<'static>, ServiceError> {
    static CONFIG: LazyLock<Arc<Config<'static>>> = LazyLock::new(|| Arc::new(Config::from("openapi.json")));
    let missing = || ServiceError::new(Reason::NotWritten, format!("{name} is not embedded"));
    utoipa_swagger_ui::serve(name, Arc::clone(&CONFIG)).ok().flatten().ok_or_else(missing)
}

/// The headers of the page and its files.
fn guarded(content_type: &str) -> HeaderMap {
    let mut headers = HeaderMap::new();
    let mut say = |name: HeaderName, value: &str| {
        if let Ok(value) = HeaderValue::from_str(value) {
            headers.insert(name, value);
        }
    };
    say(header::CONTENT_TYPE, content_type);
    say(header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY);
    say(header::X_CONTENT_TYPE_OPTIONS, "nosniff");
    say(header::REFERRER_POLICY, "no-referrer");
    headers
}
