//! Headers that say with bytes what JSON says in fields.

use axum::http::{HeaderMap, HeaderName, HeaderValue};

use mrol_service::MapVersion;

/// At which state of a map something was: its `mrol-revision`, `mrol-map-uuid` and `mrol-content-hash`.
pub(super) fn of_version(version: &MapVersion) -> HeaderMap {
    let mut headers = HeaderMap::new();
    headers.insert(HeaderName::from_static("mrol-revision"), version.revision.into());
    if let Ok(uuid) = HeaderValue::try_from(version.map_uuid.to_string()) {
        headers.insert(HeaderName::from_static("mrol-map-uuid"), uuid);
    }
    let hash = version.content_hash.map(|hash| HeaderValue::try_from(hash.to_string()));
    if let Some(Ok(hash)) = hash {
        headers.insert(HeaderName::from_static("mrol-content-hash"), hash);
    }
    headers
}
