//! `mrol doctor` on folders that are well, torn and damaged.

use std::path::PathBuf;

use serde_json::json;

use super::process::Process;
use super::{Sequence, complaint, mrol, objects};

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
    sequence.path("data/maps/office/journal-00000000000000000001.log").into()
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
    let mut bytes = std::fs::read(journal(&sequence)).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(journal(&sequence), &bytes).unwrap();

    let told = mrol(&["doctor", &data]).assert().code(1).get_output().clone();
    let told = String::from_utf8(told.stdout).unwrap();
    assert!(
        told.contains("map office: NOT WELL; revision 1") && told.contains("damaged at offset"),
        "{told}"
    );
    let ports = ["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"];
    let refused =
        complaint(&[&["serve", "--data-dir", &data, "--log-level", "error"], &ports[..]].concat(), 1);
    assert!(refused.contains("journal-00000000000000000001.log: damaged at offset"), "{refused}");
    assert!(refused.contains("--set-aside office`"), "{refused}");

    let opens = &objects(&["doctor", &data, "--set-aside", "office"])[0];
    assert_eq!(opens, &json!({"map": "office", "revision": 1}));
    assert_eq!(std::fs::read(journal(&sequence).with_extension("log.damaged")).unwrap(), bytes);
    let found = &objects(&["doctor", &data])[0];
    let aside = json!([{"file": "journal-00000000000000000001.log.damaged", "bytes": bytes.len()}]);
    assert_eq!((&found["problems"], &found["set_aside"]), (&json!([]), &aside));
    let server = Process::start(&data, &[]);
    let shown = &objects(&["maps", "show", "office", "--server", &server.grpc])[0];
    assert_eq!((&shown["revision"], &shown["scans"]), (&json!(1), &json!(1)));
}
