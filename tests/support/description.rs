//! Answers of the server held against its description of itself, `/openapi.json`: with every field that the description
//! does not have, an answer contradicts it.

use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, LazyLock, Mutex};

use jsonschema::Validator;
use mrol::access::Operation;
use reqwest::header::CONTENT_TYPE;
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};

/// The description, whose schemas take no field that they do not name.
static CLOSED: LazyLock<Value> = LazyLock::new(|| {
    let mut description = description();
    let parts = parts(&description);
    for (name, schema) in description["components"]["schemas"].as_object_mut().expect("schemas") {
        close(schema, parts.contains(name));
    }
    description
});

/// Validators that were made, by operation, status and media type.
static VALIDATORS: LazyLock<Mutex<HashMap<String, Arc<Validator>>>> = LazyLock::new(Mutex::default);

/// The description as it is served.
pub fn description() -> Value {
    serde_json::from_str(mrol::http::openapi_json().expect("a description")).expect("json")
}

/// The answer, which is as it is described. Bodies that are no JSON are not looked at.
pub async fn as_described(method: Method, path: &str, answer: Response) -> Response {
    let (status, headers) = (answer.status(), answer.headers().clone());
    let media_type = headers.get(CONTENT_TYPE).map(|kind| kind.to_str().expect("text").to_owned());
    let Some(media_type) = media_type.filter(|kind| kind == "application/json" || kind.ends_with("+json"))
    else {
        return answer;
    };
    let body = answer.bytes().await.expect("a whole body");
    if method != Method::HEAD {
        let json = serde_json::from_slice(&body).expect("json");
        check(&method, path, status, &media_type, &json);
    }
    let mut read = tonic::codegen::http::Response::new(body);
    *read.status_mut() = status;
    *read.headers_mut() = headers;
    read.into()
}

/// Holds an answer in JSON against its description.
#[track_caller]
pub fn check(method: &Method, path: &str, status: StatusCode, media_type: &str, answer: &Value) {
    let operation = operation_at(method, path);
    let key = format!("{operation:?} {status} {media_type}");
    let known = VALIDATORS.lock().expect("no panic").get(&key).cloned();
    let validator = known.unwrap_or_else(|| {
        let schema = schema(operation, status, media_type)
            .unwrap_or_else(|| panic!("{key} is not described: {answer}"));
        let made = jsonschema::validator_for(&schema).unwrap_or_else(|error| panic!("{key}: {error}"));
        Arc::clone(VALIDATORS.lock().expect("no panic").entry(key.clone()).or_insert(made.into()))
    });
    if let Some(error) = validator.iter_errors(answer).next() {
        let answer: String = answer.to_string().chars().take(1000).collect();
        panic!("{key}: {error} at {:?} in {answer}", error.instance_path().to_string());
    }
}

/// The operation whose route has this path; none where no route has.
fn operation_at(method: &Method, path: &str) -> Option<Operation> {
    let path = path.split('?').next().expect("a path");
    let is_at = |route: &str| {
        let (asked, described) = (path.split('/'), route.split('/'));
        let is_same = |(asked, described): (&str, &str)| asked == described || described.starts_with('{');
        asked.clone().count() == described.clone().count() && asked.zip(described).all(is_same)
    };
    let mut routes = Operation::ALL.iter().filter_map(|operation| Some(operation.route()?.path));
    Operation::of_request(method.as_str(), routes.find(|route| is_at(route))?)
}

/// The schema of an answer; of what is no operation, that of its status.
fn schema(operation: Option<Operation>, status: StatusCode, media_type: &str) -> Option<Value> {
    let components = &CLOSED["components"];
    let response = match operation {
        Some(operation) => {
            let route = operation.route()?;
            &CLOSED["paths"][route.path][route.method.to_lowercase()]["responses"][status.as_str()]
        }
        None => &components["responses"][status.canonical_reason()?.replace(' ', "")],
    };
    let response = match response["$ref"].as_str() {
        Some(place) => CLOSED.pointer(place.strip_prefix('#')?)?,
        None => response,
    };
    let mut schema = response["content"].get(media_type)?["schema"].clone();
    close(&mut schema, false);
    Some(json!({"allOf": [schema], "components": components}))
}

/// The names of the schemas that are parts of others.
fn parts(description: &Value) -> BTreeSet<String> {
    fn look(schema: &Value, is_part: bool, found: &mut BTreeSet<String>) {
        match schema {
            Value::Object(fields) => {
                let name =
                    fields.get("$ref").and_then(Value::as_str).and_then(|place| place.rsplit('/').next());
                found.extend(name.filter(|_| is_part).map(str::to_owned));
                for (word, within) in fields {
                    let is_part = word == "allOf" || is_part && ["anyOf", "oneOf"].contains(&word.as_str());
                    look(within, is_part, found);
                }
            }
            Value::Array(all) => all.iter().for_each(|schema| look(schema, is_part, found)),
            _ => {}
        }
    }
    let mut found = BTreeSet::new();
    look(description, false, &mut found);
    found
}

/// Has a schema take no other fields than its own, unless it is a part of one that has more.
fn close(schema: &mut Value, is_part: bool) {
    let Some(fields) = schema.as_object_mut() else { return };
    let is_open = !fields.contains_key("additionalProperties");
    if is_open && !is_part && (fields.contains_key("properties") || fields.contains_key("allOf")) {
        fields.insert("unevaluatedProperties".into(), false.into());
    }
    for (word, within) in fields.iter_mut() {
        match (word.as_str(), within) {
            ("allOf", Value::Array(all)) => all.iter_mut().for_each(|schema| close(schema, true)),
            ("anyOf" | "oneOf", Value::Array(all)) => {
                all.iter_mut().for_each(|schema| close(schema, is_part))
            }
            ("properties", Value::Object(of)) => of.values_mut().for_each(|schema| close(schema, false)),
            ("items", schema) => close(schema, false),
            _ => {}
        }
    }
}
