//! What the table of operations adds to the description of each: its name, who may ask for it, its failures.

use axum::http::Method;
use utoipa::PartialSchema;
use utoipa::openapi::extensions::ExtensionsBuilder;
use utoipa::openapi::path::{
    Operation as Described, Parameter, ParameterBuilder, ParameterIn, PathItem, Paths,
};
use utoipa::openapi::security::SecurityRequirement;
use utoipa::openapi::{Ref, RefOr, Required};

use super::failures;
use super::request_id::request_id;
use crate::access::Operation;
use crate::http::{reader, viewer};
use crate::json::described;
use crate::json::schema_of_words;

/// The name of the way in which keys are shown.
pub(super) const KEY: &str = "key";

/// Fills in what the attributes of handlers do not say.
pub(super) fn fill_in(paths: &mut Paths) {
    for &operation in Operation::ALL {
        let Some(route) = operation.route() else { continue };
        let described = paths.paths.get_mut(route.path).and_then(|item| of_method(item, route.method));
        // A test misses what nobody describes.
        let Some(described) = described else { continue };
        complete(described, operation, route.path);
    }
}

fn of_method<'a>(item: &'a mut PathItem, method: &str) -> Option<&'a mut Described> {
    match method.parse().ok()? {
        Method::GET => item.get.as_mut(),
        Method::PUT => item.put.as_mut(),
        Method::POST => item.post.as_mut(),
        Method::DELETE => item.delete.as_mut(),
        _ => None,
    }
}

fn complete(described: &mut Described, operation: Operation, path: &str) {
    described.operation_id = Some(operation.name().to_owned());
    described.tags = Some(vec![tag(operation).to_owned()]);
    let scope = operation.scope().map(|scope| scope.to_string());
    described.security = scope.map(|scope| vec![SecurityRequirement::new(KEY, [scope])]);
    if let Some(call) = operation.grpc() {
        let call = call.trim_start_matches('/');
        described.extensions = Some(ExtensionsBuilder::new().add("x-mrol-grpc", call).build());
    }
    let mut parameters: Vec<RefOr<Parameter>> = described.parameters.take().unwrap_or_default();
    if takes_json_or_bytes(described) {
        parameters.iter_mut().for_each(only_with_bytes);
    }
    parameters.splice(0..0, path_parameters(operation, path).map(RefOr::T));
    described.parameters = Some(parameters);
    for response in described.responses.responses.values_mut() {
        if let RefOr::T(response) = response {
            response.headers.insert("x-request-id".into(), request_id().into());
        }
    }
    for status in failures::of(operation) {
        let response = Ref::from_response_name(failures::name(status));
        described.responses.responses.entry(status.as_u16().to_string()).or_insert(response.into());
    }
}

/// The service of the gRPC call, which most operations have.
fn tag(operation: Operation) -> &'static str {
    let service = operation.grpc().and_then(|call| call.strip_prefix("/mrol.v1.")?.split('/').next());
    service.unwrap_or("Server")
}

fn takes_json_or_bytes(described: &Described) -> bool {
    matches!(&described.request_body, Some(RefOr::T(body)) if body.content.len() > 1)
}

/// Marks a parameter that goes with bytes alone: with JSON it is a field of the body.
fn only_with_bytes(parameter: &mut RefOr<Parameter>) {
    if let RefOr::T(parameter) = parameter {
        let (needed, about) = (&parameter.required, parameter.description.take().unwrap_or_default());
        let needed = if *needed == Required::True { "With bytes, required: " } else { "With bytes: " };
        parameter.description = Some(format!("{needed}{about}"));
        parameter.required = Required::False;
    }
}

/// What stands between braces in a path.
fn path_parameters(operation: Operation, path: &str) -> impl Iterator<Item = Parameter> {
    path.split('/').filter_map(move |segment| {
        let name = segment.strip_prefix('{')?.strip_suffix('}')?;
        let (schema, about, example) = match name {
            "map" => (described::MapName::schema(), "The name of the map", example_map(operation)),
            "name" => (described::KeepOutName::schema(), "The name of the keep-out", "dock"),
            "file" => (schema_of_words(viewer::pages::file_names()), "The name of the file", "main.js"),
            _ => (schema_of_words(reader::page::FILES), "The name of the file", reader::page::FILES[0]),
        };
        let parameter = ParameterBuilder::new().name(name).parameter_in(ParameterIn::Path);
        let parameter = parameter.required(Required::True).description(Some(about)).schema(Some(schema));
        Some(parameter.example(Some(example.into())).build())
    })
}

/// The map of `mrol demo`, and where it would be made or deleted, another one.
fn example_map(operation: Operation) -> &'static str {
    match operation {
        Operation::CreateMap | Operation::RenameMap | Operation::RestoreMap => "example",
        // The example before it has renamed it.
        Operation::DeleteMap => "renamed",
        _ => "demo",
    }
}
