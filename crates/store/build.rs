//! Compiles the messages of map files, `proto/mrol/store/v1`, without protoc: protox parses, prost generates.

use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let proto = Path::new("../../proto");
    println!("cargo::rerun-if-changed={}", proto.join("mrol/store/v1").display());
    let files = ["records", "snapshot"].map(|name| proto.join(format!("mrol/store/v1/{name}.proto")));
    prost_build::Config::new().bytes(["."]).compile_fds(protox::compile(files, [proto])?)?;
    Ok(())
}
