//! Compiles `proto/` without protoc (protox parses, prost and tonic generate), and tells the program what was built.

use std::collections::BTreeMap;
use std::fmt::Write;

use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorSet};

fn main() {
    // Cargo gives these to the programs that it runs, too. Named MROL_… they would be settings of a server.
    println!("cargo::rustc-env=BUILT_FEATURES={}", features());
    println!("cargo::rustc-env=BUILT_COMMIT={}", commit().as_deref().unwrap_or("unknown"));
    #[expect(clippy::expect_used, reason = "a build script has nobody else to tell")]
    if std::env::var_os("CARGO_FEATURE_CLIENT").is_some() {
        generate().expect("proto/mrol/v1 does not compile");
    }
}

/// The features of the crate that are built, in their order of the alphabet.
fn features() -> String {
    let names =
        std::env::vars().filter_map(|(name, _)| Some(name.strip_prefix("CARGO_FEATURE_")?.to_lowercase()));
    let mut names: Vec<String> = names.filter(|name| name != "default").collect();
    names.sort();
    names.join(", ")
}

/// The commit that is built: what SOURCE_COMMIT says, and else git of a build for use.
///
/// A developer's build names none. To be true it would be told anew after every commit, and the crate be built anew for it.
fn commit() -> Option<String> {
    println!("cargo::rerun-if-env-changed=SOURCE_COMMIT");
    if let Some(commit) = std::env::var("SOURCE_COMMIT").ok().filter(|commit| !commit.is_empty()) {
        return Some(commit);
    }
    if std::env::var("PROFILE").ok()? != "release" {
        return None;
    }
    let git = |arguments: &[&str]| {
        let output = std::process::Command::new("git").args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    // A crate that lies in the folder of another project is no commit of that.
    let (top, here) = (git(&["rev-parse", "--show-toplevel"])?, std::env::current_dir().ok()?);
    if std::fs::canonicalize(top).ok()? != here.canonicalize().ok()? {
        return None;
    }
    // The journal of HEAD grows with every commit and checkout; what else is named here makes a clean tree one with changes.
    let journal = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    for path in [&journal, "src", "Cargo.toml", "Cargo.lock", "build.rs"] {
        if std::path::Path::new(path).exists() {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    git(&["describe", "--always", "--abbrev=12", "--dirty=+changes", "--exclude=*"])
}

fn generate() -> Result<(), Box<dyn std::error::Error>> {
    let protos = ["v1/occupancy", "v1/mapping", "v1/maps", "store/v1/records", "store/v1/snapshot"];
    let protos = protos.map(|name| format!("proto/mrol/{name}.proto"));
    println!("cargo::rerun-if-changed=proto");
    let descriptors = protox::compile(&protos, ["proto"])?;
    let out = std::path::PathBuf::from(std::env::var("OUT_DIR")?);
    // What reflection shows: the API, not the map files.
    let mut api = descriptors.clone();
    api.file.retain(|file| file.package() == "mrol.v1");
    std::fs::write(out.join("mrol.v1.bin"), prost::Message::encode_to_vec(&api))?;
    std::fs::write(out.join("elements.rs"), table_of_elements(&api)?)?;
    let mut config = tonic_prost_build::Config::new();
    // By its name a message is found in the table of elements.
    config.enable_type_names();
    tonic_prost_build::configure()
        .bytes(".")
        .codec_path("crate::wire::codec::Codec")
        .build_server(std::env::var_os("CARGO_FEATURE_SERVER").is_some())
        .compile_fds_with_config(descriptors, config)?;
    Ok(())
}

/// The messages of the API in which elements are counted before they are decoded (`src/wire/codec`), as source text: of
/// each the fields that have such elements, or messages with some.
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
