//! Who may do what: every RPC and every route has a rule, and the rule holds.

#![cfg(feature = "server")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

use std::collections::BTreeSet;

use mrol::access::Operation;
use prost::Message;
use prost_types::FileDescriptorSet;

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
