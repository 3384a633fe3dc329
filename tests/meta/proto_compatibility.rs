//! Clients built against the last release keep working: what its `proto/mrol/v1` had is still there and means
//! the same on the wire.
//!
//! `tests/released/mrol.v1.bin` is the descriptor set of the last release. On a release, after this test passed:
//! `cargo test --test meta proto_compatibility -- --ignored`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use prost::Message;
use prost_types::field_descriptor_proto::Label;
use prost_types::{DescriptorProto, EnumDescriptorProto, FileDescriptorSet};

fn released_file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/released/mrol.v1.bin")
}

fn current() -> FileDescriptorSet {
    let set =
        FileDescriptorSet::decode(mrol::wire::pb::FILE_DESCRIPTOR_SET).expect("this build's descriptors");
    let file = set.file.into_iter().filter(|file| file.package() == "mrol.v1");
    // Comments may change.
    let file = file.map(|file| prost_types::FileDescriptorProto { source_code_info: None, ..file });
    FileDescriptorSet { file: file.collect() }
}

/// Everything that a client can depend on, as lines `what -> how`; a compatible change only adds lines.
fn contract(set: &FileDescriptorSet) -> BTreeMap<String, String> {
    let mut contract = BTreeMap::new();
    for file in &set.file {
        file.message_type.iter().for_each(|message| add_message(message, &mut contract));
        file.enum_type.iter().for_each(|values| add_enum(values, &mut contract));
        for service in &file.service {
            for method in &service.method {
                let how = format!(
                    "{}{} returns {}{}",
                    if method.client_streaming() { "stream " } else { "" },
                    method.input_type(),
                    if method.server_streaming() { "stream " } else { "" },
                    method.output_type()
                );
                contract.insert(format!("rpc {}.{}", service.name(), method.name()), how);
            }
        }
    }
    contract
}

fn add_message(message: &DescriptorProto, contract: &mut BTreeMap<String, String>) {
    for field in &message.field {
        let oneof = match (field.proto3_optional(), field.oneof_index) {
            (true, _) => "optional ",
            (false, Some(_)) => "oneof ",
            (false, None) => "",
        };
        let repeated = if field.label() == Label::Repeated { "repeated " } else { "" };
        let how = format!("{oneof}{repeated}{:?} {} {}", field.r#type(), field.type_name(), field.name());
        contract.insert(format!("field {}.{}", message.name(), field.number()), how);
    }
}

fn add_enum(values: &EnumDescriptorProto, contract: &mut BTreeMap<String, String>) {
    for value in &values.value {
        contract.insert(format!("value {}.{}", values.name(), value.number()), value.name().to_owned());
    }
}

/// What `released` promised and `now` does not keep.
fn broken(released: &FileDescriptorSet, now: &FileDescriptorSet) -> Vec<String> {
    let now = contract(now);
    let kept = |what: &String, how: &String| now.get(what) == Some(how);
    let broken = contract(released).into_iter().filter(|(what, how)| !kept(what, how));
    broken.map(|(what, how)| format!("{what} was: {how}; is: {:?}", now.get(&what))).collect()
}

#[test]
fn the_last_release_is_kept() {
    let bytes = std::fs::read(released_file()).expect("the last release's descriptors");
    let released = FileDescriptorSet::decode(&bytes[..]).expect("descriptors");
    assert!(contract(&released).len() > 100, "the released contract is there");
    let broken = broken(&released, &current());
    assert!(broken.is_empty(), "clients of the last release would break:\n{}", broken.join("\n"));
}

#[test]
fn a_field_that_changes_or_goes_is_noticed() {
    let released = current();
    let mut changed = current();
    let message = changed.file.iter_mut().flat_map(|file| &mut file.message_type);
    let message = message.into_iter().find(|message| message.name() == "QueryPointsRequest").unwrap();
    message.field[3].number = Some(99);
    message.field.remove(0);
    assert_eq!(broken(&released, &changed).len(), 2);
}

#[test]
#[ignore = "stores this build's contract as the last release"]
fn store_this_release() {
    std::fs::create_dir_all(released_file().parent().unwrap()).unwrap();
    std::fs::write(released_file(), current().encode_to_vec()).unwrap();
}
