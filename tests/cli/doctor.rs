//! `mrol doctor` on folders that are well, torn and damaged.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use serde_json::json;

use super::{Sequence, complaint, mrol, objects};
use crate::support::map_folders::folder_of;
use crate::support::process::Process;

/// A data folder whose server was killed after three scans.
fn killed(sequence: &Sequence) -> String {
    let data = sequence.path("data");
    let server = Process::start(&data, &[]);
    let scans = sequence.path("scans");
    let insert = ["insert", &scans, "--map", "office", "--create", "--resolution", "0.1"];
    objects(&[&insert[..], &["--server", &server.grpc]].concat());
    server.kill();
    data
}

fn journal(sequence: &Sequence) -> PathBuf {
    folder_of(Path::new(&sequence.path("data")), "office").join("journal-00000000000000000001.log")
}

#[test]
fn a_folder_that_is_well_is_told_map_by_map() {
    let sequence = Sequence::of(3);
    let data = killed(&sequence);
    let found = &objects(&["doctor", &data])[0];
    assert_eq!(
        (&found["map"], &found["revision"], &found["records"]),
        (&json!("office"), &json!(3), &json!(3))
    );
    assert_eq!((&found["snapshots"], &found["problems"]), (&json!([0]), &json!([])));
    assert!(complaint(&["doctor", &sequence.path("scans")], 2).contains("no data folder"));
    let server = Process::start(&data, &[]);
    assert!(complaint(&["doctor", &data], 1).contains("in use by another server"));
    // Told to end before it serves, it would leave the folder as it found it.
    assert_eq!(objects(&["maps", "show", "office", "--server", &server.grpc])[0]["revision"], json!(3));
    assert_eq!(server.stop(), Some(0));
    // The end wrote a snapshot, and the journal makes the same of the first one.
    let found = &objects(&["doctor", &data])[0];
    assert_eq!((&found["snapshots"], &found["problems"]), (&json!([0, 3]), &json!([])));
}

#[test]
fn a_torn_end_is_no_problem() {
    let sequence = Sequence::of(3);
    let data = killed(&sequence);
    let bytes = std::fs::read(journal(&sequence)).unwrap();
    std::fs::write(journal(&sequence), &bytes[..bytes.len() - 100]).unwrap();
    let found = &objects(&["doctor", &data])[0];
    assert_eq!((&found["revision"], &found["problems"]), (&json!(2), &json!([])));
    assert!(found["torn_bytes"].as_u64().unwrap() > 100);
    // Looking changed nothing.
    assert_eq!(std::fs::read(journal(&sequence)).unwrap().len(), bytes.len() - 100);
}

#[test]
fn a_damaged_journal_is_set_aside_and_the_map_opens_again() {
    let sequence = Sequence::of(3);
    let data = killed(&sequence);
    let damaged = journal(&sequence);
    let mut bytes = std::fs::read(&damaged).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&damaged, &bytes).unwrap();

    let told = mrol(&["doctor", &data]).assert().code(1).get_output().clone();
    let told = String::from_utf8(told.stdout).unwrap();
    assert!(
        told.contains("map office: NOT WELL; revision 1") && told.contains("damaged at offset"),
        "{told}"
    );
    let server = Process::start_with_log(&data, &[], "off", Stdio::inherit());
    let refused = complaint(&["maps", "show", "office", "--server", &server.grpc], 1);
    assert!(refused.contains("journal-00000000000000000001.log: damaged at offset"), "{refused}");
    assert!(refused.contains("--set-aside office`"), "{refused}");
    let listed = mrol(&["maps", "list", "--server", &server.grpc]).assert().success().get_output().clone();
    let listed = String::from_utf8(listed.stdout).unwrap();
    assert!(listed.contains("office") && listed.contains("--set-aside office`"), "{listed}");
    let listed = &objects(&["maps", "list", "--server", &server.grpc])[0];
    assert_eq!(listed["map"], json!("office"), "{listed}");
    assert!(listed["unavailable"].as_str().unwrap().contains("--set-aside office`"), "{listed}");
    let backup = sequence.path("backup");
    let incomplete = complaint(&["snapshot", "--all", &backup, "--server", &server.grpc], 1);
    assert!(incomplete.contains("office") && incomplete.contains("--set-aside office`"), "{incomplete}");
    assert_eq!(server.stop(), Some(0));

    let opens = &objects(&["doctor", &data, "--set-aside", "office"])[0];
    assert_eq!(opens, &json!({"map": "office", "revision": 1, "keep_outs": 0, "viewpoints": 1}));
    // The damaged folder is there as it was, under another name.
    let folder = damaged.parent().unwrap();
    let aside = format!("{}.damaged", folder.display());
    let kept = Path::new(&aside).join(damaged.file_name().unwrap());
    assert!(!folder.exists() && std::fs::read(kept).unwrap() == bytes);
    let told = mrol(&["doctor", &data]).assert().code(0).get_output().clone();
    assert!(String::from_utf8(told.stderr).unwrap().contains(&aside));
    assert_eq!(objects(&["doctor", &data])[0]["problems"], json!([]));

    // Whoever saw more of it than there is now has to notice: the map is another one.
    let server = Process::start(&data, &[]);
    let shown = &objects(&["maps", "show", "office", "--server", &server.grpc])[0];
    assert_eq!((&shown["revision"], &shown["scans"]), (&json!(1), &json!(1)));
    assert!(!folder.to_str().unwrap().contains(shown["map_uuid"].as_str().unwrap()), "{shown}");
    assert!(objects(&["maps", "list", "--server", &server.grpc]).len() == 1);
}

#[test]
fn what_nobody_understands_is_told_and_is_no_problem() {
    let sequence = Sequence::of(1);
    let data = killed(&sequence);
    let folder = folder_of(Path::new(&data), "office");
    std::fs::write(folder.join("notes.txt"), "mine").unwrap();
    std::fs::write(folder.with_file_name("lost+found"), "").unwrap();
    let told = mrol(&["doctor", &data]).assert().code(0).get_output().clone();
    assert!(String::from_utf8(told.stdout).unwrap().contains("not understood, and left alone: notes.txt"));
    assert!(String::from_utf8(told.stderr).unwrap().contains("lost+found"));
}

#[test]
fn two_folders_of_one_map_are_both_named() {
    let sequence = Sequence::of(1);
    let data = killed(&sequence);
    let folder = folder_of(Path::new(&data), "office");
    let copy = folder.with_file_name("office.00000000-0000-0000-0000-000000000007");
    std::fs::create_dir(&copy).unwrap();
    let told = mrol(&["doctor", &data]).assert().code(1).get_output().clone();
    let told = String::from_utf8(told.stdout).unwrap();
    for path in [&folder, &copy] {
        assert!(told.contains(path.to_str().unwrap()), "{told}");
    }
}

#[test]
fn a_damaged_map_file_of_the_first_format_is_a_problem_and_one_that_is_well_is_told() {
    let sequence = Sequence::of(1);
    let maps = Path::new(&sequence.path("data")).join("maps");
    std::fs::create_dir_all(&maps).unwrap();
    let released = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/released/data-1/maps/office.mrol");
    let bytes = std::fs::read(released).unwrap();
    let file = maps.join("office.mrol");
    std::fs::write(&file, &bytes).unwrap();
    let found = &objects(&["doctor", &sequence.path("data")])[0];
    assert_eq!((&found["map"], &found["problems"]), (&json!("office"), &json!([])));
    assert!(found["voxels"].as_u64().unwrap() > 0, "{found}");

    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 1;
    for damaged in [&flipped[..], &bytes[..bytes.len() / 2], b"", b"no map"] {
        std::fs::write(&file, damaged).unwrap();
        let told = mrol(&["doctor", &sequence.path("data")]).assert().code(1).get_output().clone();
        let told = String::from_utf8(told.stdout).unwrap();
        assert!(told.contains("map office: NOT WELL") && told.contains("office.mrol"), "{told}");
        assert_eq!(std::fs::read(&file).unwrap(), damaged, "looking changed nothing");

        let aside = &objects(&["doctor", &sequence.path("data"), "--set-aside", "office"])[0];
        let aside = Path::new(aside["set_aside"].as_str().unwrap()).to_owned();
        assert_eq!((std::fs::read(&aside).unwrap().as_slice(), file.exists()), (damaged, false));
        let told = mrol(&["doctor", &sequence.path("data")]).assert().code(0).get_output().clone();
        let told = String::from_utf8(told.stderr).unwrap();
        assert!(told.contains(aside.to_str().unwrap()), "{told}");
        std::fs::remove_file(aside).unwrap();
    }
    std::fs::write(&file, &bytes).unwrap();
    let told = mrol(&["doctor", &sequence.path("data"), "--set-aside", "office"]).assert().code(0);
    assert!(String::from_utf8(told.get_output().stdout.clone()).unwrap().contains("can be opened as it is"));
    assert_eq!(std::fs::read(&file).unwrap(), bytes);
}
