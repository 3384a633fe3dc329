//! Failures: which statuses an operation may answer with, and the reasons of each, from the table of reasons.

use std::collections::BTreeSet;
use std::fmt::Write;

use axum::http::StatusCode;
use utoipa::ToSchema;
use utoipa::openapi::header::{Header, HeaderBuilder};
use utoipa::openapi::schema::{AllOfBuilder, ObjectBuilder, Type};
use utoipa::openapi::{ContentBuilder, Ref, RefOr, Response, ResponseBuilder};

use super::request_id::request_id;
use crate::access::Operation;
use crate::http::error::{PROBLEM_JSON, Problem, status_of};
use crate::json::schema_of_words;
use mrol_service::{Reason, ReportedBy};

/// The statuses of failures that an operation may have.
pub(super) fn of(operation: Operation) -> BTreeSet<StatusCode> {
    use StatusCode as S;
    let mut statuses = BTreeSet::from([
        S::BAD_REQUEST,
        S::MISDIRECTED_REQUEST,
        S::TOO_MANY_REQUESTS,
        S::INTERNAL_SERVER_ERROR,
        S::SERVICE_UNAVAILABLE,
    ]);
    let Some(route) = operation.route() else { return statuses };
    if operation.scope().is_some() {
        statuses.extend([S::UNAUTHORIZED, S::FORBIDDEN]);
    }
    if route.path.contains('{') {
        statuses.extend([S::TEMPORARY_REDIRECT, S::NOT_FOUND]);
    }
    if matches!(route.method, "POST" | "PUT") {
        statuses.extend([S::REQUEST_TIMEOUT, S::PAYLOAD_TOO_LARGE, S::UNSUPPORTED_MEDIA_TYPE]);
    }
    if operation.is_change() {
        statuses.extend([S::CONFLICT, S::INSUFFICIENT_STORAGE]);
    }
    if route.path.contains("{map}/") {
        statuses.extend([S::PRECONDITION_FAILED, S::GATEWAY_TIMEOUT]);
    }
    statuses
}

/// The name of the response of a status: `BadRequest`.
pub(super) fn name(status: StatusCode) -> String {
    status.canonical_reason().unwrap_or_default().replace(' ', "")
}

/// The response of every status that HTTP tells of, by its name.
pub(super) fn responses() -> impl Iterator<Item = (String, RefOr<Response>)> {
    let statuses: BTreeSet<StatusCode> = told().map(status_of).collect();
    statuses.into_iter().map(|status| (name(status), response(status).into()))
}

/// The reasons that HTTP tells of.
fn told() -> impl Iterator<Item = Reason> {
    Reason::ALL
        .iter()
        .copied()
        .filter(|reason| matches!(reason.reported_by(), ReportedBy::Both | ReportedBy::Http))
}

fn response(status: StatusCode) -> Response {
    let reasons: Vec<Reason> = told().filter(|reason| status_of(*reason) == status).collect();
    let codes: BTreeSet<&str> = reasons.iter().map(|reason| reason.code().as_str()).collect();
    let mut meanings = String::from("Why it failed:\n");
    for reason in &reasons {
        // Writing to a String cannot fail.
        let _ = write!(meanings, "\n* `{reason}`: {}", reason.meaning());
    }
    let words = reasons.iter().map(|reason| reason.as_str());
    let reason = AllOfBuilder::new().item(schema_of_words(words)).description(Some(meanings));
    let fields = ObjectBuilder::new()
        .property(
            "status",
            ObjectBuilder::new().schema_type(Type::Integer).enum_values(Some([status.as_u16()])),
        )
        .property("code", schema_of_words(codes))
        .property("reason", reason);
    let problem = AllOfBuilder::new().item(Ref::from_schema_name(Problem::name())).item(fields);
    let content = ContentBuilder::new().schema(Some(problem)).build();
    let title = status.canonical_reason().unwrap_or_default();
    let mut response = ResponseBuilder::new().description(title).content(PROBLEM_JSON, content);
    if let Some((name, header)) = header_of(status) {
        response = response.header(name, header);
    }
    response.header("x-request-id", request_id()).build()
}

/// The header of a status, besides that of all answers.
fn header_of(status: StatusCode) -> Option<(&'static str, Header)> {
    let header = |of: Type, about: &str| {
        HeaderBuilder::new()
            .schema(Some(ObjectBuilder::new().schema_type(of)))
            .description(Some(about))
            .build()
    };
    match status {
        StatusCode::TEMPORARY_REDIRECT => {
            Some(("location", header(Type::String, "The same path and query at a node that holds the map")))
        }
        StatusCode::UNAUTHORIZED => Some(("www-authenticate", header(Type::String, "`Bearer`"))),
        StatusCode::METHOD_NOT_ALLOWED => {
            Some(("allow", header(Type::String, "The methods that the path takes")))
        }
        StatusCode::TOO_MANY_REQUESTS | StatusCode::SERVICE_UNAVAILABLE => Some((
            "retry-after",
            header(Type::Integer, "Seconds until it is worth to come again, where that is known"),
        )),
        _ => None,
    }
}
