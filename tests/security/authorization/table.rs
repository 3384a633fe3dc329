//! Every operation, in each protocol, asked for by every kind of caller about every kind of map.

use std::collections::BTreeSet;

use mrol::access::{Operation, Scope, Secret};
use prost::Message;
use prost_types::FileDescriptorSet;

use super::asking::{Outcome, over_grpc, over_http};
use super::keyring::{Guarded, Keyring};
use super::requests::names_a_map;

/// The least scope of each operation, as it is meant; none where no key is needed. An operation that is new has none
/// here and does not compile.
fn meant(operation: Operation) -> Option<Scope> {
    match operation {
        Operation::HealthCheck
        | Operation::HealthWatch
        | Operation::Live
        | Operation::Ready
        | Operation::ShowViewer
        | Operation::GetViewerFile
        | Operation::DescribeApi
        | Operation::ReadApi
        | Operation::ReadApiFile => None,
        Operation::QueryPoints
        | Operation::QueryPointsStream
        | Operation::ListVoxels
        | Operation::ListKeepOuts
        | Operation::CheckPoses
        | Operation::CheckPosesStream
        | Operation::CheckSpheres
        | Operation::CheckSpheresStream
        | Operation::CheckMotions
        | Operation::CheckMotionsStream
        | Operation::CastRays
        | Operation::CastRaysStream
        | Operation::FindNearest
        | Operation::FindNearestStream
        | Operation::ClassifyPoints
        | Operation::ClassifyPointsStream
        | Operation::ListFrontiers
        | Operation::ProjectGrid
        | Operation::StreamGrid
        | Operation::GetBlock
        | Operation::ListObservers
        | Operation::Watch
        | Operation::ListEvents
        | Operation::WatchEvents
        | Operation::AlignScan
        | Operation::Localize
        | Operation::GetTrajectory
        | Operation::StreamTrajectory
        | Operation::GetMap
        | Operation::ListMaps
        | Operation::SnapshotMap
        | Operation::Reflect
        | Operation::Metrics => Some(Scope::Read),
        Operation::InsertScan | Operation::InsertScanStream | Operation::Undo => Some(Scope::Insert),
        Operation::DeleteVoxels | Operation::PutKeepOut | Operation::DeleteKeepOut => Some(Scope::Write),
        Operation::CreateMap | Operation::RenameMap | Operation::DeleteMap | Operation::RestoreMap => {
            Some(Scope::Admin)
        }
    }
}

/// Who asks.
struct Caller {
    name: String,
    secret: Option<Secret>,
    /// None where nobody knows the secret.
    scope: Option<Scope>,
    every_map: bool,
}

/// Nobody, somebody with a secret of his own making, and the holder of a key of each scope, for every map and for
/// `own` alone.
fn callers(keyring: &Keyring) -> Vec<Caller> {
    let stranger = |name: &str, secret| Caller { name: name.into(), secret, scope: None, every_map: false };
    let mut callers = vec![stranger("nobody", None), stranger("stranger", Some(Secret::random().unwrap()))];
    for scope in Scope::ALL {
        for (every_map, maps) in [(true, None), (false, Some(&["own"][..]))] {
            let name = format!("{scope}-{}", if every_map { "every" } else { "own" });
            let secret = Some(keyring.add(&name, scope, maps));
            callers.push(Caller { name, secret, scope: Some(scope), every_map });
        }
    }
    callers
}

/// What must come of asking: the reason of the refusal, or none.
fn expected(operation: Operation, caller: &Caller, map: &str) -> Option<&'static str> {
    let needed = meant(operation)?;
    let Some(scope) = caller.scope else {
        return Some(if caller.secret.is_some() { "key_unknown" } else { "key_missing" });
    };
    let other_maps = if names_a_map(operation) { map != "own" } else { operation == Operation::Metrics };
    match () {
        () if scope < needed => Some("scope_too_small"),
        () if other_maps && !caller.every_map => Some("map_not_allowed"),
        () => None,
    }
}

fn reason(outcome: &Outcome) -> Option<&str> {
    match outcome {
        Outcome::LetIn => None,
        Outcome::Unknown { reason } => Some(reason),
        Outcome::Denied { reason, .. } => Some(reason),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_rpc_and_route_for_every_scope_and_right_and_wrong_maps() {
    let (server, callers) = Guarded::start_with(callers).await;
    let channel = server.daemon.channel().await;
    let (mut asked, mut let_in) = (0, 0);
    for &operation in Operation::ALL {
        let maps: &[&str] = if names_a_map(operation) { &["own", "other", "absent"] } else { &["own"] };
        for (caller, &map) in callers.iter().flat_map(|caller| maps.iter().map(move |map| (caller, map))) {
            server.make_map("own").await;
            server.make_map("other").await;
            let key = caller.secret.as_ref();
            let mut outcomes = Vec::new();
            if let Some(call) = operation.grpc() {
                outcomes.push(("grpc", over_grpc(channel.clone(), operation, call, map, key).await));
            }
            if let Some(route) = operation.route() {
                outcomes.push(("http", over_http(&server, operation, route, map, key).await));
            }
            assert!(!outcomes.is_empty(), "{operation:?} is nowhere");
            let expected = expected(operation, caller, map);
            for (protocol, outcome) in &outcomes {
                let name = &caller.name;
                assert_eq!(reason(outcome), expected, "{protocol} {operation:?} by {name} about {map}");
                assert_eq!(
                    matches!(outcome, Outcome::Unknown { .. }),
                    expected.is_some_and(|r| r.starts_with("key_"))
                );
            }
            asked += outcomes.len();
            if expected.is_some() {
                assert_eq!(server.maps().await, ["other", "own"], "{operation:?} by {}", caller.name);
            } else {
                let_in += outcomes.len();
                // Where it was made.
                server.http(reqwest::Method::DELETE, "/v1/maps/absent", Some(&server.master), None).await;
            }
        }
    }
    println!("asked {asked} times, let in {let_in} times");
    assert!(let_in > 100 && asked - let_in > 100);
}

#[test]
fn every_rpc_of_the_contract_has_a_rule_and_every_rule_an_rpc() {
    let served = [
        mrol::wire::pb::FILE_DESCRIPTOR_SET,
        tonic_health::pb::FILE_DESCRIPTOR_SET,
        tonic_reflection::pb::v1::FILE_DESCRIPTOR_SET,
    ];
    let served: BTreeSet<String> = served.into_iter().flat_map(calls).collect();
    let ruled: BTreeSet<String> = Operation::ALL.iter().filter_map(|o| o.grpc()).map(String::from).collect();
    assert!(served.len() > 16, "{served:?}");
    assert_eq!(served, ruled);
}

/// The path of every RPC of a compiled contract.
fn calls(contract: &[u8]) -> BTreeSet<String> {
    let mut calls = BTreeSet::new();
    for file in FileDescriptorSet::decode(contract).unwrap().file {
        for service in &file.service {
            let call = |method| format!("/{}.{}/{method}", file.package(), service.name());
            calls.extend(service.method.iter().map(|method| call(method.name())));
        }
    }
    calls
}
