//! Words that gave way to the field's own stay away: from the code, the contract and the documents.

use std::fs;
use std::path::{Path, PathBuf};

/// A word that is not used any more, as a whole word, and what is said instead.
const REPLACED: [(&str, &str); 90] = [
    ("ReachIndex", "CoverageIndex"),
    ("Gaze", "ViewpointCache"),
    ("gaze", "cache"),
    ("WellBeyond", "AbsenceEvidence"),
    ("sees_well_beyond", "proves_absent"),
    ("others_see_through", "is_free_by_others"),
    ("sees_beyond", "depth_exceeds"),
    ("may_look_into", "may_cover"),
    ("ToldBy", "ReportedBy"),
    ("told_by", "reported_by"),
    ("ahead::fetch", "prefetch"),
    ("Interest", "StopSignal"),
    ("LASTING", "StopSignal::NEVER"),
    ("is_lost", "is_stopped"),
    ("align_while", "align_until"),
    ("Reloaded", "ReloadableFile"),
    ("Room", "ResourceBudget (of memory), CapacitySchedule (of a map)"),
    ("MapReach", "AllowedMaps"),
    ("ScanReach", "AllowedScans"),
    ("REACH_MAX", "DISTANCE_MAX"),
    ("reach_m", "extent_m"),
    ("BlockTable", "ClusterTable"),
    ("Renewal", "ClusterUpdate"),
    ("Observations", "VoxelOwnership"),
    ("held_by_targets_alone", "voxels_only_in"),
    ("AnsweredRequest", "CompletedRequest"),
    ("TrajectoryPose", "MappedScan"),
    ("MapState", "MapVersion"),
    ("UsableScan", "FilteredScan"),
    ("Committing", "CommitQueue"),
    ("propose", "submit"),
    ("committing", "commit_queue"),
    ("carry_through", "submit_and_wait"),
    ("to_its_end", "run_to_completion"),
    ("turn_of", "lock_robot"),
    ("UndoScans", "Undo"),
    ("UndoScansRequest", "UndoRequest"),
    ("given_up", "cancelled"),
    ("file_in_force", "reload_ok"),
    ("Arrival", "InboundBody"),
    ("Asking", "RateLimitKey"),
    ("Charge", "MemoryPermit"),
    ("HangUp", "CloseConnection"),
    ("BODY_SILENT", "Reason::BodyStalled"),
    ("body_silent", "body_stalled"),
    ("TimelyBody", "AnswerBody"),
    ("HeldBody", "AnswerBody"),
    ("timely_body", "answer_body"),
    ("whole_messages", "message_framing"),
    ("Around", "Middleware"),
    ("MeteredService", "Observer"),
    ("AdmissionLimits", "Limits"),
    ("LimitsConfig", "Limits"),
    ("server::places", "connection_slots"),
    ("server::entrance", "access_policy"),
    ("accepting.rs", "listener.rs"),
    ("housekeeping.rs", "background.rs"),
    ("open_files.rs", "rlimit.rs"),
    ("wide_start", "multi_start"),
    ("judge_at", "evaluate_at"),
    ("on_the_callers_word", "accepted_by_caller"),
    ("show_each", "write_plane_bits"),
    ("take_stock", "import_map_files and map_names"),
    ("unblocked_rate", "ideal_false_positive_rate"),
    ("false_positives_equation_1", "ideal_false_positive_rate"),
    ("filter_bits_per_voxel", "bits_per_key"),
    ("disk_free_back_mib", "disk_free_resume_mib"),
    ("memory_back_mib", "memory_resume_mib"),
    ("is_standing", "is_stationary"),
    ("StandingSettings", "StationarySettings"),
    ("twin", "scalar or SIMD variant, reference implementation"),
    ("twins", "scalar and SIMD variants"),
    ("quantise", "quantize"),
    ("quantised", "quantized"),
    ("quantisation", "quantization"),
    ("neighbour", "neighbor"),
    ("neighbours", "neighbors"),
    ("neighbouring", "neighboring"),
    ("centre", "center"),
    ("centres", "centers"),
    ("metre", "meter"),
    ("metres", "meters"),
    ("catalogue", "catalog"),
    ("colour", "color"),
    ("colours", "colors"),
    ("behaviour", "behavior"),
    ("serialise", "serialize"),
    ("initialise", "initialize"),
    ("normalise", "normalize"),
    ("optimise", "optimize"),
];

/// Where an old word is the right one: an error names what a setting was called before, a workload is a room, and over
/// the wire a pose of a trajectory is just that.
const ALLOWED: [(&str, &str); 9] = [
    ("src/config/loading.rs", "disk_free_back_mib"),
    ("src/config/loading.rs", "memory_back_mib"),
    ("crates/lab/", "Room"),
    ("crates/simulate/", "Room"),
    ("src/cli/map/", "Room"),
    ("crates/client/", "TrajectoryPose"),
    ("src/http/operations/trajectory.rs", "TrajectoryPose"),
    ("proto/mrol/v1/", "TrajectoryPose"),
    ("docs/lab-notes.md", "Around"),
];

#[test]
fn no_old_word_is_left() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = vec![root.join("README.md")];
    for folder in ["src", "crates", "proto", "docs"] {
        texts(&root.join(folder), &mut files);
    }
    let mut found = Vec::new();
    for path in files {
        let file = path.strip_prefix(root).unwrap().to_str().unwrap().to_owned();
        let text = fs::read_to_string(&path).unwrap();
        for (old, new) in REPLACED {
            let allowed = |(folder, word): &(&str, &str)| file.starts_with(folder) && *word == old;
            if ALLOWED.iter().any(allowed) {
                continue;
            }
            for (number, line) in text.lines().enumerate().filter(|(_, line)| has_word(line, old)) {
                found.push(format!("{file}:{}: {old:?} is {new:?} now: {}", number + 1, line.trim()));
            }
        }
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// Comments are read beside other code, in columns.
const COLUMNS: usize = 120;

#[test]
fn comments_keep_to_their_columns() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = vec![root.join("build.rs")];
    for folder in ["src", "crates", "clients/c", "clients/python-replica", "examples", "tests"] {
        texts(&root.join(folder), &mut files);
    }
    let mut found = Vec::new();
    for path in files.iter().filter(|path| path.extension().is_some_and(|extension| extension == "rs")) {
        let text = fs::read_to_string(path).unwrap();
        for (number, line) in text.lines().enumerate() {
            if line.trim_start().starts_with("//") && line.chars().count() > COLUMNS {
                found.push(format!("{}:{}", path.display(), number + 1));
            }
        }
    }
    assert!(found.is_empty(), "comments beyond {COLUMNS} columns:\n{}", found.join("\n"));
}

fn has_word(line: &str, word: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(word).any(|(at, _)| {
        let (before, after) = (line[..at].chars().next_back(), line[at + word.len()..].chars().next());
        !before.is_some_and(is_part) && !after.is_some_and(is_part)
    })
}

fn texts(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_text = |extension: &str| path.extension().is_some_and(|of| of == extension);
        if path.is_dir() {
            texts(&path, files);
        } else if ["rs", "md", "proto", "toml"].into_iter().any(is_text) {
            files.push(path);
        }
    }
}
