//! Lists of every message that an RPC names, as the contract has them and not as the table of this module does.

use std::collections::BTreeMap;

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorSet};
use tonic::Status;

use super::elements;
use super::most::{LINKS_MAX, elements_max};
use super::too_many::TooMany;
use crate::wire::pb;

/// The contract: its messages by name, and which of them are requests and answers.
struct Contract {
    messages: BTreeMap<String, DescriptorProto>,
    requests: Vec<String>,
    answers: Vec<String>,
}

/// The fields that lead from a message to one of its own or of messages in it.
type Path<'a> = Vec<&'a FieldDescriptorProto>;

impl Contract {
    fn read() -> Self {
        let files = FileDescriptorSet::decode(pb::FILE_DESCRIPTOR_SET).unwrap().file;
        let methods: Vec<_> =
            files.iter().flat_map(|file| &file.service).flat_map(|service| &service.method).collect();
        let requests = methods.iter().map(|method| method.input_type().to_owned()).collect();
        let answers = methods.iter().map(|method| method.output_type().to_owned()).collect();
        let messages = files.into_iter().flat_map(|file| file.message_type);
        let named = |message: DescriptorProto| {
            // A map would be a list of a message in this one.
            assert!(message.nested_type.is_empty(), "{}", message.name());
            (format!(".mrol.v1.{}", message.name()), message)
        };
        Self { messages: messages.map(named).collect(), requests, answers }
    }

    /// All fields of a message and of those in it.
    fn fields(&self, message: &str) -> Vec<Path<'_>> {
        let Some(message) = self.messages.get(message) else { return Vec::new() };
        let of_field = |field| {
            let inner = self.fields(FieldDescriptorProto::type_name(field)).into_iter();
            let inner = inner.map(move |path| [&[field][..], &path].concat());
            std::iter::once(vec![field]).chain(inner)
        };
        message.field.iter().flat_map(of_field).collect()
    }

    /// The paths to lists whose elements may be shorter on the wire than in memory.
    fn lists(&self, message: &str) -> Vec<Path<'_>> {
        let is_list = |path: &Path<'_>| {
            let last = path[path.len() - 1];
            let is_number =
                !matches!(last.r#type(), Type::Message | Type::String | Type::Bytes | Type::Group);
            last.label() == Label::Repeated && !is_number
        };
        self.fields(message).into_iter().filter(is_list).collect()
    }
}

/// A message with so many elements that have nothing in the list at the end of a path.
fn message(path: &Path<'_>, elements: usize) -> Vec<u8> {
    path.iter().rev().enumerate().fold(Vec::new(), |inner, (outwards, field)| {
        let mut bytes = Vec::new();
        for _ in 0..if outwards == 0 { elements } else { 1 } {
            prost::encoding::bytes::encode(field.number() as u32, &inner, &mut bytes);
        }
        bytes
    })
}

fn check(name: &str, bytes: &[u8]) -> Result<(), TooMany> {
    elements::check(name.trim_start_matches('.'), bytes, elements_max)
}

#[test]
fn every_list_of_every_request_and_answer_is_bounded_and_the_refusal_names_it() {
    let contract = Contract::read();
    let mut lists = 0;
    for name in contract.requests.iter().chain(&contract.answers) {
        for path in contract.lists(name) {
            let field = path.iter().map(|field| field.name()).collect::<Vec<_>>().join(".");
            let most = elements_max(path[path.len() - 1].name());
            assert_eq!(check(name, &message(&path, most)), Ok(()), "{name} {field}");
            let refused = check(name, &message(&path, most + 1)).unwrap_err();
            assert_eq!(refused, TooMany { field, most }, "{name}");
            lists += 1;
        }
    }
    assert!(lists > 20, "{lists} lists");
}

/// Those of numbers need no bound: a number takes in memory what it takes on the wire, where it is no varint.
#[test]
fn numbers_in_lists_of_requests_have_a_fixed_size() {
    let contract = Contract::read();
    let mut numbers = 0;
    for path in contract.requests.iter().flat_map(|name| contract.fields(name)) {
        let last = path[path.len() - 1];
        if last.label() == Label::Repeated && last.type_name().is_empty() {
            assert!(matches!(last.r#type(), Type::Double | Type::Float | Type::Fixed64), "{}", last.name());
            numbers += 1;
        }
    }
    assert!(numbers > 3, "{numbers} lists of numbers");
}

#[test]
fn the_parts_of_a_list_count_together() {
    let body = message(&body_links(&Contract::read()), LINKS_MAX / 2 + 1);
    let name = "mrol.v1.CheckPosesRequest";
    assert_eq!(check(name, &body), Ok(()));
    let refused = check(name, &body.repeat(2)).unwrap_err();
    assert_eq!(refused, TooMany { field: "body.links".into(), most: LINKS_MAX });
}

#[test]
fn what_stands_beside_a_list_is_passed_over_and_what_cannot_be_read_is_left_to_the_decoder() {
    let (name, contract) = ("mrol.v1.CheckPosesRequest", Contract::read());
    let links = message(&body_links(&contract), LINKS_MAX + 1);
    // Field 99 as a group with a number in it, which no version knows, and the body's own number with another type.
    let unknown = [155, 6, 8, 1, 156, 6, 2 << 3, 1];
    assert!(check(name, &[&unknown, &links[..]].concat()).is_err());
    for unreadable in [&[0xff][..], &[2 << 3 | 2, 0xff], &[2 << 3 | 2, 5, 1], &[4], &[7]] {
        assert!(pb::CheckPosesRequest::decode(unreadable).is_err());
        assert_eq!(check(name, &[unreadable, &links].concat()), Ok(()));
    }
    assert!(check(name, &links).is_err());
}

#[test]
fn a_refusal_has_its_word_for_programs() {
    let status = Status::from(TooMany { field: "body.links".into(), most: 3 });
    assert_eq!(status.code(), tonic::Code::InvalidArgument);
    assert_eq!(status.message(), "body.links has more than 3 entries in one message");
    assert_eq!(status.metadata().get(crate::wire::REASON).unwrap(), "batch_too_large");
}

/// The links of the body of a check.
fn body_links(contract: &Contract) -> Path<'_> {
    let lists = contract.lists(".mrol.v1.CheckPosesRequest");
    lists.into_iter().find(|path| path.len() == 2 && path[1].name() == "links").unwrap()
}
