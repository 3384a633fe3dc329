//! Compiles `proto/` without protoc: protox parses, prost and tonic generate.

fn main() {
    #[expect(clippy::expect_used, reason = "a build script has nobody else to tell")]
    if std::env::var_os("CARGO_FEATURE_CLIENT").is_some() {
        generate().expect("proto/mrol/v1 does not compile");
    }
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
    tonic_prost_build::configure()
        .bytes(".")
        // Bounded as it is read.
        .extern_path(".mrol.v1.Body", "crate::wire::pb::Body")
        .build_server(std::env::var_os("CARGO_FEATURE_SERVER").is_some())
        .compile_fds(descriptors)?;
    Ok(())
}
