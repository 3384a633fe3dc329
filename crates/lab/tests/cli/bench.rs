//! `mrol-lab bench`: what is measured is there and makes sense; how fast it is, is not tested.

use super::{Sequence, complaint, lab, number, objects, texts};
use mrol::geometry::Point;
use mrol::scan::{write_f32, write_ply};

#[test]
fn structures_answer_alike_and_each_has_a_line() {
    let names = ["bloom", "exact", "bloom-kernel", "exact-kernel", "hashset", "dense", "paper"];
    let structures = names.join(",");
    let lines =
        objects(&["bench", "lookup", "--structures", &structures, "--queries", "20000", "--repeats", "2"]);
    assert_eq!(texts(&lines, "structure"), names);
    for line in &lines {
        let fields = ["structure", "ns_per_point", "points", "occupied", "false_positives", "bytes"];
        assert!(line.as_object().unwrap().keys().all(|key| fields.contains(&key.as_str())), "{line}");
        assert!(number(line, "ns_per_point") > 0.0 && number(line, "bytes") > 1000.0, "{line}");
        assert_eq!(number(line, "points"), 20_000.0);
        let truly = number(line, "occupied") - number(line, "false_positives");
        assert_eq!(truly, number(&lines[1], "occupied"));
    }
}

#[test]
fn each_of_a_planners_questions_has_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let peer_file = folder.path().join("arms.bin");
    let few = ["--poses", "200", "--point-poses", "50", "--scans", "2", "--repeats", "1", "--peer-file"];
    let lines = objects(&[&["bench", "planning"], &few[..], &[peer_file.to_str().unwrap()]].concat());
    // What comes before the arms are the voxels.
    assert!(std::fs::metadata(&peer_file).unwrap().len() > 200 * (59 * 4 + 1) * 4 + 150_000 * 12);
    assert_eq!(texts(&lines, "what"), ["arm", "arm", "points", "motions", "changing"]);
    let (arms, lines) = lines.split_at(2);
    assert!(arms.iter().map(|arm| number(arm, "links")).eq([11.0, 8.0]));
    assert!(arms.iter().all(|arm| number(arm, "ns_per_pose") > 0.0 && number(arm, "field_bytes") > 10_000.0));
    assert_eq!((number(&lines[0], "poses"), number(&lines[1], "colliding")), (50.0, 128.0));
    assert!(number(&lines[2], "new_voxels_per_scan") > 0.0);
}

#[test]
fn planners_questions_to_a_server_have_a_line_each_and_so_have_scans_beside_them() {
    let lines = objects(&["bench", "questions", "--seconds", "0.3", "--azimuths", "60", "--rings", "20"]);
    let scans = ["scans, nobody asks", "scans, 100 asked after", "the 100"];
    let questions = ["arms, 90 % free", "arms, half free", "cycles", "rays", "rays, in process"];
    let motions = ["motions beside scans", "motions of a replica"];
    assert_eq!(texts(&lines, "what"), [&scans[..], &questions[..], &motions[..]].concat());
    for line in &lines {
        assert!(number(line, "messages") > 0.0 && number(line, "p50_ms") > 0.0, "{line}");
        assert!(number(line, "p99_ms") >= number(line, "p50_ms"), "{line}");
    }
    let items = lines.iter().map(|line| number(line, "items_per_message"));
    assert!(items.eq([1.0, 1.0, 1.0, 1000.0, 1000.0, 56_000.0, 1200.0, 1200.0, 256.0, 256.0]), "{lines:?}");
}

#[test]
fn a_query_only_map_takes_the_memory_of_its_set_alone() {
    let lines = objects(&["bench", "memory", "--workload", "room"]);
    assert_eq!(texts(&lines, "keeps"), ["all", "no moments", "no filter", "query only"]);
    let of = |line: usize, part: &str| number(&lines[line], &format!("{part}_per_voxel"));
    assert_eq!((of(3, "filters"), of(3, "moments")), (0.0, 0.0));
    assert_eq!((of(3, "masks"), of(3, "tables")), (of(0, "masks"), of(0, "tables")));
    assert!(of(3, "bytes") < 1.5 && of(0, "bytes") > 20.0, "{lines:?}");
}

#[test]
fn files_of_points_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let row = |n: usize| (0..n).map(|i| Point::new(i as f32 * 0.1 + 0.05, 0.05, 0.05)).collect::<Vec<_>>();
    write_ply(path("map.ply").as_ref(), &row(300)).unwrap();
    write_f32(path("scan.f32").as_ref(), &row(1000)).unwrap();
    let (map, scan) = (path("map.ply"), path("scan.f32"));
    let files =
        ["bench", "lookup", "--voxels", &map, "--points", &scan, "--resolution", "0.1", "--repeats", "1"];
    let lines = objects(&files);
    assert_eq!(texts(&lines, "structure"), ["bloom", "exact", "hashset", "dense", "paper"]);
    assert_eq!((number(&lines[1], "points"), number(&lines[1], "occupied")), (1000.0, 300.0));

    let moved = objects(&[&files[..], &["--pose", "-10 0 0 0 0 0 1", "--structures", "exact"]].concat());
    assert_eq!(number(&moved[0], "occupied"), 300.0);
    let coarse = objects(&[&files[..], &["--level", "2", "--structures", "exact"]].concat());
    assert_eq!(number(&coarse[0], "occupied"), 300.0);
}

#[test]
fn an_array_that_would_not_fit_is_left_out_with_a_word() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.f32");
    write_f32(&path, &[Point::new(0.0, 0.0, 0.0), Point::new(900.0, 900.0, 900.0)]).unwrap();
    let file = path.to_str().unwrap();
    let files = ["bench", "lookup", "--voxels", file, "--points", file, "--resolution", "0.1", "--json"];
    let output = lab(&files).assert().success().get_output().clone();
    assert!(!String::from_utf8(output.stdout).unwrap().contains("dense"));
    assert!(String::from_utf8(output.stderr).unwrap().contains("dense is left out: "));
}

#[test]
fn options_that_make_no_sense_together_are_usage_errors() {
    assert!(complaint(&["bench", "lookup", "--level", "6", "--queries", "1"], 2).contains("--level"));
    assert!(complaint(&["bench", "insert", "--levels", "13", "--queries", "1"], 2).contains("levels"));
    lab(&["bench", "lookup", "--voxels", "a.ply"]).assert().code(2);
    lab(&["bench", "serve", "--http", "http://127.0.0.1:1"]).assert().code(2);
}

#[test]
fn insertion_is_timed_for_new_and_known_points() {
    let lines = objects(&["bench", "insert", "--queries", "3000", "--scan-points", "1000", "--repeats", "2"]);
    assert_eq!(texts(&lines, "structure"), ["map", "map", "map", "hashset", "hashset"]);
    assert_eq!(texts(&lines, "points_are"), ["new", "known", "removed", "new", "known"]);
    assert!(lines.iter().all(|line| number(line, "points") == 3000.0 && number(line, "ns_per_point") > 0.0));
}

#[test]
fn alignments_of_files_are_timed_by_method_and_structure() {
    let sequence = Sequence::of(3);
    let (scans, truth) = (sequence.path("scans"), sequence.path("poses.txt"));
    let lines = objects(&["bench", "align", &scans, "--truth", &truth, "--repeats", "1"]);
    assert_eq!(texts(&lines, "lookup"), ["bloom", "exact", "bloom", "exact"]);
    for line in &lines {
        assert_eq!(number(line, "scans"), 2.0);
        assert!(
            number(line, "ms_median") > 0.0 && line["error_m"]["median"].as_f64().unwrap() < 0.1,
            "{line}"
        );
    }
}

#[test]
fn readers_are_timed_alone_together_and_beside_a_writer() {
    let lines = objects(&["bench", "readers", "--queries", "50000", "--rounds", "1", "--seconds", "0.05"]);
    let crowds: Vec<_> =
        lines.iter().map(|line| (number(line, "readers"), number(line, "writers"))).collect();
    assert_eq!(crowds, [(1.0, 0.0), (2.0, 0.0), (1.0, 1.0)]);
    assert!(number(&lines[2], "commits_per_s") > 0.0 && number(&lines[0], "of_one") == 1.0);
}

#[test]
fn a_server_of_its_own_is_asked_by_every_protocol() {
    let serve = ["bench", "serve", "--seconds", "0.1", "--points", "1000,5000", "--queries", "20000"];
    let lines = objects(&[&serve[..], &["--connections", "2"]].concat());
    assert_eq!(texts(&lines, "protocol"), ["grpc", "grpc-stream", "http", "grpc", "grpc-stream", "http"]);
    for line in &lines {
        assert!(number(line, "messages") > 0.0 && number(line, "points_per_s") > 0.0, "{line}");
        assert!(number(line, "p50_us") > 0.0 && number(line, "p99_us") >= number(line, "p50_us"), "{line}");
        assert!((0.03..0.2).contains(&number(line, "share_occupied")), "{line}");
    }
}

#[test]
fn a_soak_tells_what_a_fleet_got_and_how_memory_went() {
    // Three seconds show no trend, and what else a machine does is none: memory may double here, and time run out.
    let short = ["bench", "soak", "--seconds", "3", "--capacity-seconds", "1", "--report-seconds", "1"];
    let fleet = ["--load", "0.3", "--planners", "2", "--robots", "2", "--queries", "20000"];
    let bounds = ["--growth-max", "1", "--left-max", "1"];
    let lines = objects(&[&short[..], &fleet[..], &bounds[..]].concat());
    let (verdict, lines) = lines.split_last().unwrap();
    assert!(lines.len() >= 2 && lines.iter().all(|line| number(line, "resident_bytes") > 1e6), "{lines:?}");
    assert!(lines.iter().all(|line| number(&line["queries"], "operations") > 0.0), "{lines:?}");
    for kind in ["queries", "changes"] {
        assert_eq!(number(&verdict[kind], "errors"), 0.0, "{verdict}");
        assert!(number(&verdict[kind], "p99_ms") >= number(&verdict[kind], "p50_ms"), "{verdict}");
    }
    assert!(number(verdict, "mean_resident_bytes") > 1e6, "{verdict}");
}

#[test]
fn replicas_have_the_maps_hash_at_every_revision_beside_a_stalled_watcher_and_after_restarts() {
    let short =
        ["bench", "watch", "--watchers", "4", "--seconds", "1", "--rate", "10", "--scan-points", "2000"];
    let lines = objects(&short);
    let (verdict, stages) = lines.split_last().unwrap();
    let numbers = |field| stages.iter().map(|stage| number(stage, field)).collect::<Vec<_>>();
    assert_eq!(texts(stages, "stage").len(), 5);
    assert!(
        number(verdict, "hashes_compared") > 40.0 && number(verdict, "hashes_differing") == 0.0,
        "{verdict}"
    );
    assert_eq!(
        (numbers("copies_min"), numbers("copies_max")),
        (vec![0.0, 1.0, 1.0, 1.0, 2.0], vec![0.0, 1.0, 1.0, 1.0, 2.0])
    );
    // Where the server is killed, scans may fail, and nowhere else.
    assert_eq!(numbers("failed")[..3], [0.0; 3], "{lines:?}");
    assert!(numbers("resident_bytes").iter().all(|bytes| *bytes > 1e6), "{lines:?}");
}

#[test]
fn a_replica_is_asked_beside_its_map() {
    let replica = ["bench", "replica", "--points", "1000,30000", "--queries", "50000", "--repeats", "2"];
    let lines = objects(&replica);
    let (copied, lines) = lines.split_first().unwrap();
    assert!(number(copied, "voxels") > 150e3 && number(copied, "seconds") > 0.0, "{copied}");
    // A voxel of a surface is some bits on the way, and some bytes in memory.
    let a_voxel = |field| number(copied, field) / number(copied, "voxels");
    assert!(
        (0.1..10.0).contains(&a_voxel("bytes_sent")) && (0.5..50.0).contains(&a_voxel("map_bytes")),
        "{copied}"
    );
    assert_eq!(texts(lines, "through").len(), 8);
    assert!(lines.iter().all(|line| number(line, "ns_per_point") > 0.0 && number(line, "of_map") > 0.0));
}
