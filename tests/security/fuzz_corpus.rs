//! Every input that is kept of fuzzing (`tests/fuzz/corpus`), run through its target once more: what was found and
//! mended stays so.

#[path = "../fuzz/src/lib.rs"]
#[allow(
    clippy::allow_attributes,
    clippy::duplicate_mod,
    unreachable_pub,
    reason = "the fuzzers use it from outside"
)]
mod files;
#[path = "../fuzz/server/src/lib.rs"]
#[allow(clippy::allow_attributes, unreachable_pub, reason = "the fuzzers use it from outside")]
mod server;

use std::path::{Path, PathBuf};

/// The inputs kept for a target, in order.
fn kept(target: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(target);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut inputs: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    inputs.sort();
    assert!(!inputs.is_empty(), "nothing is kept for {target}");
    inputs
}

/// Calls the target of that name.
fn run(name: &str, input: &[u8]) {
    match files::TARGETS.iter().any(|(target, _)| *target == name) {
        true => files::run(name, input),
        false => server::run(name, input),
    }
}

/// Runs what is kept for a target; the name of the input at hand is in the output of a test that fails.
fn replay(target: &str) {
    for input in kept(target) {
        println!("{}", input.display());
        run(target, &std::fs::read(&input).expect("an input"));
    }
}

macro_rules! replayed {
    ($($target:ident)*) => {
        $(
            #[test]
            fn $target() {
                replay(stringify!($target));
            }
        )*

        #[test]
        fn no_target_is_left_out() {
            let all: Vec<&str> = files::TARGETS.iter().chain(&server::TARGETS).map(|(name, _)| *name).collect();
            assert_eq!(all, [$(stringify!($target)),*]);
        }
    };
}

replayed!(journal record map_file ply pcd text log octree arrays las e57 depth_image config keys grpc http);
