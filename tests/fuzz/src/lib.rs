//! What is fuzzed of files: functions of bytes that panic where a promise is broken. The fuzzers call them with what
//! they make up, `tests/security/fuzz_corpus.rs` with the inputs that are kept.

mod frames;
mod journal;
mod log;
mod map_file;
mod map_files;
mod map_state;
mod record;
mod scan_files;
#[path = "../../support/simulated_disk.rs"]
#[allow(dead_code, unreachable_pub, reason = "it is used in part")]
mod simulated;
mod surveys;

/// A function that is fuzzed.
pub type Target = fn(&[u8]);

/// All of them, by name.
pub const TARGETS: [(&str, Target); 12] = [
    ("journal", journal::journal),
    ("record", record::record),
    ("map_file", map_file::map_file),
    ("ply", scan_files::ply),
    ("pcd", scan_files::pcd),
    ("text", scan_files::text),
    ("log", log::log),
    ("octree", map_files::octree),
    ("arrays", map_files::arrays),
    ("las", surveys::las),
    ("e57", surveys::e57),
    ("depth_image", surveys::depth_image),
];

/// Calls the target of that name.
pub fn run(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|(target, _)| *target == name);
    target.unwrap_or_else(|| panic!("no target {name}")).1(bytes);
}
