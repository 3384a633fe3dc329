//! What a crate compiles is what it is for.

use std::process::Command;

/// Names of the crates that `package` is made of, without what its tests need.
fn made_of(package: &str) -> Vec<String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let tree = Command::new(cargo)
        .args(["tree", "--locked", "--offline", "--edges", "normal", "--prefix", "none", "--format", "{p}"])
        .args(["--package", package])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let text = String::from_utf8(tree.stdout).unwrap();
    text.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned).collect()
}

#[track_caller]
fn check_without(package: &str, others: &[&str]) {
    let made_of = made_of(package);
    assert!(made_of.iter().any(|name| name == package), "{made_of:?}");
    let found: Vec<_> = others.iter().filter(|other| made_of.iter().any(|name| name == *other)).collect();
    assert!(found.is_empty(), "{package} compiles {found:?}");
}

#[test]
fn the_core_has_no_runtime_no_protocol_and_no_serialization() {
    let others = ["tokio", "tonic", "axum", "prost", "serde", "hyper", "tower", "utoipa", "tracing"];
    check_without("mrol-map", &others);
}

#[test]
fn logs_are_read_on_the_core_alone() {
    let others = ["tokio", "tonic", "prost", "serde", "mrol-store", "mrol-service", "mcap", "lz4-sys"];
    check_without("mrol-logs", &others);
}

#[test]
fn files_of_other_programs_are_read_on_the_core_alone() {
    let others = ["tokio", "tonic", "prost", "serde", "mrol-store", "mrol-service", "mrol-logs"];
    check_without("mrol-files", &others);
}

#[test]
fn planners_compile_no_server() {
    let server = ["mrol", "axum", "clap", "utoipa", "figment", "metrics", "tonic-health", "tonic-reflection"];
    check_without("mrol-client", &server);
}

#[test]
fn what_nodes_share_is_kept_without_a_server() {
    let server = ["mrol", "axum", "clap", "utoipa", "figment", "metrics", "tonic-health", "tonic-reflection"];
    check_without("mrol-cluster", &server);
}

#[test]
fn the_server_compiles_no_lab() {
    check_without("mrol", &["mrol-lab", "plotters", "hdrhistogram", "criterion"]);
}
