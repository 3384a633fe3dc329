//! Answers that are files of the viewer.

use super::files;
use axum::extract::Path;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::files::{File, INDEX};
use crate::http::error::HttpError;
use crate::http::forms::NoParams;
use mrol_map::util::excerpt;
use mrol_service::{Reason, ServiceError};

/// What the page may load and do: scripts, styles, pictures and requests of this server alone, no inline script, no
/// form that leaves it, no frame around it.
const CONTENT_SECURITY_POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self'; \
     frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
);

/// The names of its files.
pub(crate) fn file_names() -> impl Iterator<Item = &'static str> {
    files::FILES.iter().map(|file| file.name)
}

/// Shows the page that draws a map.
#[utoipa::path(
    get,
    path = "/",
    responses(
        (status = 200, description = "The page", body = String, content_type = "text/html; charset=utf-8"),
        (status = 304, description = "The browser has it already")
    )
)]
pub(crate) async fn index(NoParams: NoParams, headers: HeaderMap) -> Response {
    respond(&INDEX, &headers)
}

/// Gives out one of the files that the page is made of.
#[utoipa::path(
    get,
    path = "/viewer/{file}",
    responses(
        (status = 200, description = "The file", content(
            (String = "text/javascript; charset=utf-8"),
            (String = "text/css; charset=utf-8"),
            (String = "image/svg+xml")
        )),
        (status = 304, description = "The browser has it already")
    )
)]
pub(crate) async fn file(
    Path(name): Path<String>,
    NoParams: NoParams,
    headers: HeaderMap,
) -> Result<Response, HttpError> {
    let found = files::find(&name).ok_or_else(|| {
        ServiceError::new(Reason::RouteNotFound, format!("no route /viewer/{}", excerpt(&name)))
    })?;
    Ok(respond(found, &headers))
}

/// A file, or that the one the browser has is still the same.
fn respond(file: &File, asked: &HeaderMap) -> Response {
    let etag = files::etag();
    // A proxy that compresses marks the tag as weak, and a browser may name several.
    let names_it = |known: &HeaderValue| {
        etag.to_str().is_ok_and(|etag| known.to_str().is_ok_and(|known| known.contains(etag)))
    };
    let is_known = asked.get_all(header::IF_NONE_MATCH).iter().any(names_it);
    let headers = [
        (header::ETAG, etag.clone()),
        (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
        (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
        (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    ];
    if is_known {
        return (StatusCode::NOT_MODIFIED, headers).into_response();
    }
    let content_type = [(header::CONTENT_TYPE, HeaderValue::from_static(file.content_type()))];
    (headers, content_type, file.text).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::to_bytes;

    #[tokio::test]
    async fn a_file_comes_once_and_then_only_word_that_it_is_the_same() {
        let first = index(NoParams, HeaderMap::new()).await;
        assert_eq!(first.status(), StatusCode::OK);
        assert_eq!(first.headers()[header::CONTENT_TYPE], "text/html; charset=utf-8");
        let etag = first.headers()[header::ETAG].clone();
        let weak = HeaderValue::from_str(&format!("\"other\", W/{}", etag.to_str().unwrap())).unwrap();
        let asked = HeaderMap::from_iter([(header::IF_NONE_MATCH, weak)]);
        assert_eq!(index(NoParams, asked).await.status(), StatusCode::NOT_MODIFIED);
        let asked = HeaderMap::from_iter([(header::IF_NONE_MATCH, etag)]);
        let again = index(NoParams, asked).await;
        assert_eq!(again.status(), StatusCode::NOT_MODIFIED);
        assert!(to_bytes(again.into_body(), 1).await.unwrap().is_empty());
        let other = HeaderMap::from_iter([(header::IF_NONE_MATCH, HeaderValue::from_static("\"other\""))]);
        assert_eq!(index(NoParams, other).await.status(), StatusCode::OK);
    }

    #[tokio::test]
    async fn every_answer_forbids_what_the_page_does_not_do() {
        for answer in [
            index(NoParams, HeaderMap::new()).await,
            file(Path("main.js".to_owned()), NoParams, HeaderMap::new()).await.unwrap(),
        ] {
            let said = |name| answer.headers()[name].to_str().unwrap();
            let policy = said("content-security-policy");
            assert!(policy.starts_with("default-src 'none'; script-src 'self'; "), "{policy}");
            assert!(!policy.contains("unsafe") && policy.contains("frame-ancestors 'none'"), "{policy}");
            assert_eq!(said("x-content-type-options"), "nosniff");
            assert_eq!(said("referrer-policy"), "no-referrer");
            assert_eq!(said("cache-control"), "no-cache");
        }
    }

    #[tokio::test]
    async fn a_name_that_is_none_of_the_files_is_no_route() {
        for name in ["../Cargo.toml", "index.html", "main", "", "MAIN.JS"] {
            let refused = file(Path(name.to_owned()), NoParams, HeaderMap::new()).await.unwrap_err();
            assert_eq!(refused.into_response().status(), StatusCode::NOT_FOUND, "{name}");
        }
    }
}
