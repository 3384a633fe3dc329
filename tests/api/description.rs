//! The server's description of its HTTP interface, and the page that shows it.

use std::collections::{BTreeMap, BTreeSet};

use mrol::access::{Operation, Scope};
use mrol::wire::pb;
use prost::Message;
use prost_types::FileDescriptorSet;
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use crate::support::daemon::{Daemon, client, corner};
use crate::support::description::{as_described, check, description};

/// RPCs without a route of their own: they answer many messages of another RPC, which has one.
const STREAMS: [&str; 9] = [
    "Occupancy/QueryPointsStream",
    "Occupancy/CheckPosesStream",
    "Occupancy/CheckSpheresStream",
    "Occupancy/CheckMotionsStream",
    "Occupancy/CastRaysStream",
    "Occupancy/FindNearestStream",
    "Occupancy/ClassifyPointsStream",
    "Mapping/InsertScanStream",
    "Mapping/StreamTrajectory",
];

/// What the contract, the table of operations or the description says of an operation.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Known {
    name: String,
    route: String,
    rpc: Option<String>,
    scope: Option<String>,
}

fn of_table(operation: &Operation) -> Option<Known> {
    let route = operation.route()?;
    Some(Known {
        name: operation.name().to_owned(),
        route: format!("{} {}", route.method, route.path),
        rpc: operation.grpc().map(|call| call.trim_start_matches('/').to_owned()),
        scope: operation.scope().as_ref().map(Scope::to_string),
    })
}

/// The described operations, each with its path and method.
fn described(description: &Value) -> impl Iterator<Item = (&str, &str, &Value)> {
    let paths = description["paths"].as_object().unwrap().iter();
    paths.flat_map(|(path, item)| {
        item.as_object().unwrap().iter().map(move |(method, of)| (path.as_str(), method.as_str(), of))
    })
}

/// The RPCs of the contract.
fn rpcs() -> BTreeSet<String> {
    let contract = FileDescriptorSet::decode(pb::FILE_DESCRIPTOR_SET).unwrap();
    let services = contract.file.iter().flat_map(|file| &file.service);
    services
        .flat_map(|service| {
            service.method.iter().map(|rpc| format!("mrol.v1.{}/{}", service.name(), rpc.name()))
        })
        .collect()
}

#[test]
fn the_description_the_table_of_operations_and_the_contract_know_the_same() {
    let description = description();
    let of_description = described(&description).map(|(path, method, of)| Known {
        name: of["operationId"].as_str().unwrap_or_default().to_owned(),
        route: format!("{} {path}", method.to_uppercase()),
        rpc: of["x-mrol-grpc"].as_str().map(str::to_owned),
        scope: of["security"][0]["key"][0].as_str().map(str::to_owned),
    });
    let of_description: BTreeSet<Known> = of_description.collect();
    assert_eq!(of_description, Operation::ALL.iter().filter_map(of_table).collect());

    let with_a_route = of_description.into_iter().filter_map(|known| known.rpc);
    let streams = STREAMS.iter().map(|stream| format!("mrol.v1.{stream}"));
    assert_eq!(with_a_route.chain(streams).collect::<BTreeSet<_>>(), rpcs());
}

#[tokio::test]
async fn every_described_operation_is_served_and_every_other_method_is_not() {
    let daemon = Daemon::start().await;
    let description = description();
    let mut methods = BTreeMap::<&str, BTreeSet<String>>::new();
    for (path, method, _) in described(&description) {
        methods.entry(path).or_default().insert(method.to_uppercase());
    }
    for (path, mut methods) in methods {
        if methods.contains("GET") {
            methods.insert("HEAD".into());
        }
        let path = path
            .replace("{map}", "a")
            .replace("{name}", "a")
            .replace("{file}", "main.js")
            .replace("{asset}", "start.js");
        let refused = client().patch(daemon.url(&path)).send().await.unwrap();
        assert_eq!(refused.status(), StatusCode::METHOD_NOT_ALLOWED, "{path}");
        let allowed = refused.headers()["allow"].to_str().unwrap().split(',').map(str::to_owned).collect();
        assert_eq!(methods, allowed, "{path}");
    }
}

/// The schema that a node of the description refers to, or the node.
fn resolved<'a>(description: &'a Value, node: &'a Value) -> &'a Value {
    node["$ref"].as_str().map_or(node, |place| description.pointer(&place[1..]).unwrap())
}

/// The address of the example of an operation.
fn example_address(path: &str, operation: &Value) -> String {
    let mut address = path.to_owned();
    let mut query = Vec::new();
    for parameter in operation["parameters"].as_array().unwrap() {
        let name = parameter["name"].as_str().unwrap();
        let Some(example) = parameter.get("example") else { continue };
        let example = example.as_str().map_or(example.to_string(), str::to_owned);
        match parameter["in"].as_str().unwrap() {
            "path" => address = address.replace(&format!("{{{name}}}"), &example),
            _ => query.push(format!("{name}={example}")),
        }
    }
    if query.is_empty() { address } else { format!("{address}?{}", query.join("&")) }
}

/// In the order of the table, in which what an example needs was made by an earlier one.
#[tokio::test]
async fn the_examples_run_on_the_map_of_the_demonstration_and_fit_their_schemas() {
    let daemon = Daemon::start().await;
    assert_eq!(
        daemon.put("/v1/maps/demo", json!({"resolution_m": 0.03})).await.status(),
        StatusCode::CREATED
    );
    daemon.put_in("demo", &corner()).await;
    let description = description();
    let mut bodies = 0;
    for operation in Operation::ALL {
        let Some(route) = operation.route() else { continue };
        let described = &description["paths"][route.path][route.method.to_lowercase()];
        let address = example_address(route.path, described);
        let mut request = client().request(route.method.parse().unwrap(), daemon.url(&address));
        if let Some(content) = described["requestBody"]["content"].as_object() {
            // A map file is no example that could be written down.
            let Some(json) = content.get("application/json") else { continue };
            let schema = resolved(&description, &json["schema"]);
            let schema = json!({"allOf": [schema], "components": description["components"]});
            let example = &schema["allOf"][0]["example"];
            let validator = jsonschema::validator_for(&schema).unwrap();
            assert!(validator.is_valid(example), "{operation:?}: {example}");
            request = request.json(example);
            bodies += 1;
        }
        let answer = request.send().await.unwrap();
        let status = answer.status();
        let answer = as_described(route.method.parse().unwrap(), &address, answer).await;
        let said = if status.is_success() { String::new() } else { answer.text().await.unwrap() };
        assert!(status.is_success(), "{operation:?} {address}: {status} {said}");
    }
    assert!(bodies > 12, "{bodies}");
}

#[test]
#[should_panic(expected = "'extra' was unexpected")]
fn an_answer_with_a_field_that_is_not_described_is_found() {
    let answer = json!({"revision": 1, "map_uuid": "", "keep_outs": [], "extra": 1});
    check(&Method::GET, "/v1/maps/a/keep-outs", StatusCode::OK, "application/json", &answer);
}

#[test]
#[should_panic(expected = "is not described")]
fn an_answer_with_a_status_that_is_not_described_is_found() {
    check(&Method::GET, "/v1/maps", StatusCode::IM_A_TEAPOT, "application/json", &json!({}));
}

#[test]
#[should_panic(expected = "is not one of")]
fn a_failure_for_a_reason_of_another_status_is_found() {
    let problem =
        json!({"title": "", "status": 404, "detail": "", "code": "not_found", "reason": "bad_pose"});
    check(&Method::GET, "/v1/maps/a", StatusCode::NOT_FOUND, "application/problem+json", &problem);
}

#[tokio::test]
async fn the_reader_is_a_page_that_loads_from_this_server_alone() {
    let daemon = Daemon::start().await;
    let page = daemon.get("/docs").await;
    let policy = page.headers()["content-security-policy"].to_str().unwrap().to_owned();
    for rule in ["default-src 'none'", "script-src 'self';", "connect-src 'self'", "frame-ancestors 'none'"] {
        assert!(policy.contains(rule), "{rule} is not in {policy}");
    }
    let page = page.text().await.unwrap();
    let mut addresses: Vec<&str> = Vec::new();
    for attribute in ["src=\"", "href=\""] {
        addresses.extend(page.split(attribute).skip(1).map(|rest| rest.split('"').next().unwrap()));
    }
    assert!(addresses.len() >= 4, "{addresses:?}");
    for address in addresses.into_iter().filter(|address| *address != "data:,") {
        assert!(!address.starts_with('/') && !address.contains(':'), "{address} is not relative");
        let file = daemon.get(&format!("/{address}")).await;
        assert_eq!(file.status(), StatusCode::OK, "{address}");
        assert_eq!(file.headers()["x-content-type-options"], "nosniff", "{address}");
        let kind = file.headers()["content-type"].to_str().unwrap();
        let expected = [(".css", "text/css"), (".js", "text/javascript"), (".json", "application/json")];
        let expected = expected.iter().find(|(extension, _)| address.ends_with(extension)).unwrap().1;
        assert!(kind.starts_with(expected), "{address}: {kind}");
    }
    for other in ["index.html", "oauth2-redirect.html", "..%2fopenapi.json"] {
        assert_eq!(daemon.get(&format!("/docs/{other}")).await.status(), StatusCode::NOT_FOUND, "{other}");
    }
}
