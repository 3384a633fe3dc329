//! `mrol-lab experiment`: plots and tables are there and complete; how fast things are, is not tested.

use std::path::Path;

use super::{Sequence, complaint, number, objects, texts};

/// The numbers of a column of a CSV file, which are finite.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let place = rows.next().unwrap().iter().position(|head| *head == name).unwrap();
    let numbers: Vec<f64> = rows.map(|cells| cells[place].parse().unwrap()).collect();
    assert!(numbers.iter().all(|number| number.is_finite()), "{name}: {numbers:?}");
    numbers
}

#[test]
fn experiment_1_leaves_a_plot_and_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/results");
    let out_dir = out.to_str().unwrap();
    let lines = objects(&["experiment", "lookup", "--out", out_dir, "--runs", "3", "--points", "2000"]);
    assert_eq!(lines.len(), 8);
    let csv = std::fs::read_to_string(out.join("lookup.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 8 * 3);
    let svg = std::fs::read_to_string(out.join("lookup.svg")).unwrap();
    assert!(texts(&lines, "stage").iter().all(|stage| svg.contains(stage) && csv.contains(stage)));
}

#[test]
fn scaling_leaves_a_plot_and_tables() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let sizes = ["--sizes", "2000,20000", "--points", "2000", "--repeats", "1"];
    let lines = objects(&[&["experiment", "scaling", "--out", out][..], &sizes].concat());
    assert_eq!(lines.len(), 2 * 2 * 3);
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!((read("scaling.csv").lines().count(), read("scaling.md").lines().count()), (13, 4));
    assert!(read("scaling.svg").contains("hashset, scan"));
}

#[test]
fn convergence_counts_every_trial_of_every_method() {
    let sequence = Sequence::of(3);
    let [target, source, truth, out] =
        ["scans/0000.ply", "scans/0002.ply", "poses.txt", "results"].map(|name| sequence.path(name));
    let options = ["--truth", &truth, "--resolution", "0.1", "--trials", "6", "--out", &out];
    let lines = objects(&[&["experiment", "convergence", &target, &source][..], &options].concat());
    assert_eq!(texts(&lines, "method"), ["refined", "overlap"]);
    assert!(lines.iter().all(|line| number(line, "trials") == 6.0 && number(line, "ms_median") > 0.0));
    assert!(number(&lines[0], "converged") >= 0.5, "{lines:?}");

    let out = Path::new(&out);
    let trials = out.join("convergence.csv");
    let converged = std::fs::read_to_string(&trials).unwrap().matches(",true,").count();
    let counted: f64 = lines.iter().map(|line| number(line, "converged") * 6.0).sum();
    assert_eq!(converged as f64, counted.round());
    for name in ["error_m", "error_deg", "ms"] {
        assert_eq!(column(&trials, name).len(), 12);
    }
    assert!(column(&out.join("guesses.csv"), "offset_m").iter().all(|&meters| meters < 2.0));
    // A head and its rule, a row for each of 4 x 4 bins, and one for all.
    let table = std::fs::read_to_string(out.join("convergence.md")).unwrap();
    assert_eq!(table.lines().count(), 2 + 16 + 1);
    assert!(table.lines().last().unwrap().starts_with("| all | all | 6 |"), "{table}");
}

#[test]
fn a_scan_without_a_true_pose_is_named() {
    let sequence = Sequence::of(2);
    let [target, truth, out] = ["scans/0000.ply", "poses.txt", "results"].map(|name| sequence.path(name));
    let options = ["--truth", &truth, "--resolution", "0.1", "--out", &out];
    let longer = Sequence::of(3);
    let source = longer.path("scans/0002.ply");
    let complaint = complaint(&[&["experiment", "convergence", &target, &source][..], &options].concat(), 1);
    assert!(complaint.contains("2 poses, none for") && complaint.contains("0002.ply"), "{complaint}");
}

#[test]
fn a_simulation_has_the_exact_sets_poses_where_the_filter_is_ample() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let lines = objects(&["experiment", "simulation", "--out", out, "--scans", "4"]);
    let answers = ["exact set", "default filter", "small filter", "ample filter"];
    assert_eq!(texts(&lines, "answers"), [answers, answers].concat());
    for line in &lines {
        assert_eq!(number(line, "scans"), 4.0);
        let like_exact = line["poses_are_the_exact_sets"] == true;
        assert!(!like_exact || number(line, "furthest_from_exact_m") == 0.0, "{line}");
        assert!(number(line, "error_m_median") < 0.1 && number(line, "voxels") > 5000.0, "{line}");
    }
    for ample in [&lines[3], &lines[7]] {
        assert!(number(ample, "expected_false_positives") < 1.0, "{ample}");
        assert_eq!(ample["poses_are_the_exact_sets"], true, "{ample}");
    }
    assert!(number(&lines[2], "false_positive_rate") > 0.2, "{}", lines[2]);

    let scans = folder.path().join("simulation.csv");
    for name in ["error_m", "error_deg", "voxels", "align_ms"] {
        assert_eq!(column(&scans, name).len(), 2 * 4 * 4);
    }
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("simulation.md").lines().count(), 2 + 2 * 4);
    let curves =
        ["overlap, exact set", "refined, ample filter", "overlap, small filter", "at the true poses"];
    assert!(curves.iter().all(|curve| read("simulation.svg").contains(curve)));
}

#[test]
fn mapping_times_every_scan_in_every_map() {
    let sequence = Sequence::of(4);
    let [scans, truth, out] = ["scans", "poses.txt", "results"].map(|name| sequence.path(name));
    let mapping = ["experiment", "mapping", &scans, "--resolution", "0.05", "--out", &out];
    let lines = objects(&[&mapping[..], &["--truth", &truth]].concat());
    let maps = ["bloom", "hash table", "bloom, refined", "weighted sum", "odometry"];
    assert_eq!(texts(&lines, "map"), maps);
    for line in &lines {
        assert!(number(line, "update_ms") > 0.0 && line["error_m"]["max"].as_f64().unwrap() < 0.2, "{line}");
    }
    assert!(lines[..4].iter().all(|line| number(line, "align_ms") > 0.0), "{lines:?}");
    assert!(lines[4].get("align_ms").is_none());
    let out = Path::new(&out);
    for name in ["align_ms", "update_ms", "voxels", "error_m", "error_deg"] {
        assert_eq!(column(&out.join("mapping.csv"), name).len(), 4 * 5);
    }
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    assert_eq!(read("mapping.md").lines().count(), 2 + 5);
    assert!(maps.iter().all(|map| read("mapping.svg").contains(map)));
}

#[test]
fn odometry_is_found_beside_the_scans_and_left_out_where_there_is_none() {
    let sequence = Sequence::of(3);
    let [scans, truth, out] = ["scans", "poses.txt", "results"].map(|name| sequence.path(name));
    let mapping = ["experiment", "mapping", &scans, "--out", &out];
    assert_eq!(texts(&objects(&mapping), "map"), ["bloom", "hash table", "bloom, refined", "weighted sum"]);

    std::fs::copy(&truth, sequence.path("scans/poses_odometry.txt")).unwrap();
    let lines = objects(&[&mapping[..], &["--truth", &truth]].concat());
    assert_eq!(texts(&lines, "map")[4], "odometry");
    assert!(lines[4]["error_m"]["max"].as_f64().unwrap() < 1e-9, "{}", lines[4]);
}

#[test]
fn an_attack_tells_what_each_honest_caller_waited_for_and_what_became_of_each_attack() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let attacks = ["poses", "listings", "tiny-scans", "connections", "watches"];
    let names = attacks.join(",");
    // What else the machine does is no fault of the server.
    let goals = ["--times-max", "1e9", "--p99-max-s", "1e9", "--livez-max-ms", "1e9"];
    let run = |seconds: &str| {
        let short =
            ["experiment", "attack", "--seconds", seconds, "--alone-seconds", "2", "--site-voxels", "2000"];
        objects(&[&short[..], &["--attacks", &names, "--out", out], &goals].concat())
    };
    // Attackers are nice: on a machine with other work it takes a while until any of them has an answer.
    let told = |line: &serde_json::Value| number(line, "answered") + number(line, "refused");
    let is_told = |lines: &Vec<serde_json::Value>| lines[6..].iter().map(told).sum::<f64>() > 0.0;
    let lines = ["4", "16", "64"].into_iter().map(run).find(is_told).expect("an attacker has an answer");
    let (callers, attackers) = lines.split_at(6);
    assert_eq!(texts(attackers, "attack"), attacks);
    for line in callers {
        assert_eq!(
            [&line["alone"], &line["attacked"]].map(|phase| number(phase, "errors")),
            [0.0; 2],
            "{line}"
        );
        assert!(number(&line["attacked"], "requests") >= 1.0 && number(line, "times_p99") > 0.0, "{line}");
    }
    let rows = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap().lines().count();
    assert_eq!(["attack.csv", "attack.md", "attackers.csv"].map(rows), [1 + 12, 2 + 12, 1 + 5]);
}

#[test]
fn an_attack_whose_goals_are_missed_says_which() {
    let short = ["experiment", "attack", "--seconds", "1", "--alone-seconds", "1", "--site-voxels", "2000"];
    let complaint =
        complaint(&[&short[..], &["--attacks", "connections", "--livez-max-ms", "0"]].concat(), 1);
    assert!(complaint.contains("/livez: p99.9 is") && complaint.contains("--livez-max-ms 0"), "{complaint}");
}
