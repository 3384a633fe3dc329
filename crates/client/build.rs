//! Compiles the API, `proto/mrol/v1`, without protoc: protox parses, prost and tonic generate messages and clients.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorSet};

fn main() -> Result<(), Box<dyn Error>> {
    let proto = Path::new("../../proto");
    println!("cargo::rerun-if-changed={}", proto.join("mrol/v1").display());
    let files = ["occupancy", "mapping", "maps"].map(|name| proto.join(format!("mrol/v1/{name}.proto")));
    let api = protox::compile(files, [proto])?;
    let out = PathBuf::from(std::env::var("OUT_DIR")?);
    // What reflection shows, and what the server's stubs are made of.
    std::fs::write(out.join("mrol.v1.bin"), prost::Message::encode_to_vec(&api))?;
    std::fs::write(out.join("elements.rs"), table_of_elements(&api)?)?;
    let mut config = tonic_prost_build::Config::new();
    // By its name a message is found in the table of elements.
    config.enable_type_names();
    tonic_prost_build::configure()
        .bytes(".")
        .codec_path("crate::wire::codec::Codec")
        .build_server(false)
        .compile_fds_with_config(api, config)?;
    Ok(())
}

/// The messages of the API in which elements are counted before they are decoded (`crates/client/src/wire/codec`), as
/// source text: of each the fields that have such elements, or messages with some.
fn table_of_elements(api: &FileDescriptorSet) -> Result<String, std::fmt::Error> {
    let messages = api.file.iter().flat_map(|file| &file.message_type);
    let messages: BTreeMap<String, &DescriptorProto> =
        messages.map(|message| (format!(".mrol.v1.{}", message.name()), message)).collect();
    let is_in_table = |name: &str| {
        messages
            .get(name)
            .is_some_and(|message| message.field.iter().any(|field| has_elements(field, &messages)))
    };
    let mut table = String::from("&[\n");
    for (name, message) in &messages {
        let fields = message.field.iter().filter(|field| has_elements(field, &messages));
        let fields: Vec<&FieldDescriptorProto> = fields.collect();
        if fields.is_empty() {
            continue;
        }
        writeln!(table, "    Elements {{ message: {:?}, fields: &[", &name[1..])?;
        for field in fields {
            let (number, name, is_counted) = (field.number(), field.name(), is_counted(field));
            let of = Some(field.type_name()).filter(|of| is_in_table(of)).map_or("", |of| &of[1..]);
            writeln!(
                table,
                "        Field {{ number: {number}, name: {name:?}, is_counted: {is_counted}, of: {of:?} }},"
            )?;
        }
        writeln!(table, "    ] }},")?;
    }
    table.push_str("]\n");
    Ok(table)
}

/// True of a list whose elements take more memory than their bytes on the wire, which may be none.
fn is_counted(field: &FieldDescriptorProto) -> bool {
    field.label() == Label::Repeated && matches!(field.r#type(), Type::Message | Type::String | Type::Bytes)
}

/// True where a field is such a list, or a message that has one. No message of the API holds itself.
fn has_elements(field: &FieldDescriptorProto, messages: &BTreeMap<String, &DescriptorProto>) -> bool {
    let inner = messages.get(field.type_name()).map_or(&[][..], |message| &message.field);
    is_counted(field) || inner.iter().any(|field| has_elements(field, messages))
}
