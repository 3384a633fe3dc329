//! What the tests share.

use std::io::Write;
use std::path::{Path, PathBuf};

use mrol_files::octree::{Leaf, OctreeError, OctreeReader};

/// A file beside the tests.
pub(crate) fn fixture(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name);
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A file of the folder of data that lies beside the repository; none, said loudly, where it is not there.
pub(crate) fn shared(name: &str) -> Option<Vec<u8>> {
    let folder = match std::env::var_os("MROL_SCANS") {
        Some(folder) => PathBuf::from(folder),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
    };
    let path = folder.join(name);
    std::fs::read(&path)
        .inspect_err(|error| {
            let thread = std::thread::current();
            let test = thread.name().unwrap_or("a test");
            let line =
                format!("SKIPPED {test}: {}: {error} (set MROL_SCANS to the folder)\n", path.display());
            // The macros write into what the harness keeps back.
            let _ = std::io::stderr().write_all(line.as_bytes());
        })
        .ok()
}

/// All leaves of an octree.
pub(crate) fn leaves_of(bytes: &[u8]) -> Result<Vec<Leaf>, OctreeError> {
    let mut reader = OctreeReader::new(bytes)?;
    let mut leaves = Vec::new();
    while let Some(leaf) = reader.next_leaf()? {
        leaves.push(leaf);
    }
    Ok(leaves)
}

/// The same number from the same seed on every machine.
pub(crate) fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *state >> 33
}
