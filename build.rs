//! Generates the server's side of the API, and tells the program what was built.

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo gives these to the programs that it runs, too. Named MROL_… they would be settings of a server.
    println!("cargo::rustc-env=BUILT_FEATURES={}", features());
    println!("cargo::rustc-env=BUILT_COMMIT={}", commit().as_deref().unwrap_or("unknown"));
    generate()
}

/// The features of the crate that are built, in their order of the alphabet; "none" as a rule.
fn features() -> String {
    let names =
        std::env::vars().filter_map(|(name, _)| Some(name.strip_prefix("CARGO_FEATURE_")?.to_lowercase()));
    let mut names: Vec<String> = names.filter(|name| name != "default").collect();
    names.sort();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// The commit that is built: what SOURCE_COMMIT says, and else git of a build for use.
///
/// A developer's build names none. To be true it would be told anew after every commit, and the crate be built anew for
/// it.
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
    // The journal of HEAD grows with every commit and checkout; what else is named here makes a clean tree one with
    // changes. Commands are not: the library would be built anew for a word of their help.
    let journal = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    let modules = std::fs::read_dir("src").ok()?.flatten().map(|entry| entry.path());
    let library =
        modules.filter(|path| !["cli", "demo", "main.rs"].iter().any(|program| path.ends_with(program)));
    let others = [&journal, "crates", "Cargo.toml", "Cargo.lock", "build.rs"].map(std::path::PathBuf::from);
    for path in library.chain(others).filter(|path| path.exists()) {
        println!("cargo::rerun-if-changed={}", path.display());
    }
    git(&["describe", "--always", "--abbrev=12", "--dirty=+changes", "--exclude=*"])
}

/// Traits and routers of the services in `proto/mrol/v1`; their messages are those of the client's crate.
fn generate() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto/mrol/v1");
    let services = ["occupancy", "mapping", "maps"].map(|name| format!("proto/mrol/v1/{name}.proto"));
    tonic_prost_build::configure()
        .extern_path(".mrol.v1", "::mrol_client::wire::pb")
        .codec_path("mrol_client::wire::codec::Codec")
        .build_client(false)
        .compile_fds(protox::compile(services, ["proto"])?)?;
    Ok(())
}
