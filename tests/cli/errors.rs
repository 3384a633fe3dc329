//! What goes wrong is said in a sentence, and told by the exit code.

use super::{complaint, mrol};

/// A folder with a file of that name and content; the file's path.
fn file(name: &str, content: &[u8]) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    (folder, path.to_str().unwrap().to_owned())
}

#[test]
fn files_that_are_no_scans_are_named() {
    let map = |path: &str| complaint(&["map", path, "--resolution", "0.1"], 1);
    assert!(map("no-such-folder").contains("no-such-folder: "));
    let (_folder, path) = file("scan.las", b"LASF");
    assert!(map(&path).contains("unsupported extension \"las\""));
    // The file is looked at before a server is asked.
    let insert = complaint(&["insert", &path, "--map", "a", "--server", "http://127.0.0.1:9"], 1);
    assert!(insert.contains("supported are .ply .pcd .xyz .npy .bin .f32 .3d"), "{insert}");
    let (_folder, path) = file("scan.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n");
    assert!(map(&path).contains("scan.ply"));
    let (_folder, path) = file("scan.f32", &[0; 13]);
    assert!(map(&path).contains("12 bytes"));
    let (folder, _) = file("notes.txt", b"nothing");
    assert!(map(folder.path().to_str().unwrap()).contains("no scan file"));
}

#[test]
fn what_is_no_sensor_model_is_refused_with_the_limit() {
    let (_folder, path) = file("scan.xyz", b"1 1 1\n");
    let said = complaint(&["map", &path, "--resolution", "0.1", "--sensor", "spinning 2000 1800 -24.9 2"], 2);
    assert!(said.contains("rings must lie in 1..=1024, got 2000"), "{said}");
    let said = complaint(&["insert", &path, "--map", "a", "--sensor", "lidar"], 2);
    assert!(said.contains("a sensor model must be") && said.contains("got \"lidar\""), "{said}");
    let other = ["map", &path, "--resolution", "0.1", "--sensor", "spinning 64 1800 -24.9 2"];
    let mapped = super::objects(&other);
    let reason = mapped[0]["reason"].as_str().unwrap();
    assert!(reason.contains("its sensor model \"spinning 64 1800 -24.9 2\" is not used"), "{reason}");
}

#[test]
fn a_scan_of_nothing_but_no_returns_is_named() {
    let (_folder, path) = file("scan.xyz", b"nan nan nan\nnan 0 0\n");
    assert!(
        complaint(&["map", &path, "--resolution", "0.1"], 1).contains("none of its 2 points is a return")
    );
    let (_folder, path) = file("scan.xyz", b"0 0 0\nnan 0 0\n-0 0 0\n");
    let said = complaint(&["map", &path, "--resolution", "0.1"], 1);
    assert!(said.contains("1 not finite, 2 at 0 0 0") && said.contains("--keep-zeros"), "{said}");
}

#[test]
fn a_scan_without_a_return_is_skipped_and_the_map_of_the_others_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let wall = |y: i32| (0..40).map(move |i| format!("3 {} {}\n", f64::from(y) / 10.0, f64::from(i) / 10.0));
    let seen: String = (0..40).flat_map(wall).collect();
    for (name, content) in [("0", "nan 0 0\n"), ("1", &seen), ("2", ""), ("3", "0 0 0\n"), ("4", &seen)] {
        std::fs::write(folder.path().join(format!("scan{name}.xyz")), content).unwrap();
    }
    let (scans, out) = (folder.path().to_str().unwrap(), folder.path().join("a.mrol"));
    let arguments =
        ["map", scans, "--resolution", "0.1", "--first-pose", "0 0 5 0 0 0 1", "--lookup", "exact"];
    let lines = super::objects(&[&arguments[..], &["--out", out.to_str().unwrap()]].concat());
    let told: Vec<_> = lines.iter().map(|line| (&line["skipped"], &line["accepted"])).take(5).collect();
    let (yes, no, none) = (&true.into(), &false.into(), &serde_json::Value::Null);
    // A wall alone does not say where it was seen from again.
    assert_eq!(told, [(yes, no), (none, yes), (yes, no), (yes, no), (none, no)]);
    assert!(
        lines[0]["reason"].as_str().unwrap().contains("none of its 1 points is a return"),
        "{}",
        lines[0]
    );
    assert_eq!(lines[2]["reason"], "no point in this file");
    // The first pose is that of the first scan that is mapped.
    assert_eq!(lines[1]["map_from_sensor"]["translation_m"][2], 5.0);
    let summary = &lines[5]["summary"];
    assert_eq!(
        (&summary["scans"], &summary["accepted"], &summary["skipped"]),
        (&5.into(), &1.into(), &3.into())
    );
    assert!(out.is_file());
    let said = mrol(&arguments).assert().success().get_output().stdout.clone();
    let said = String::from_utf8(said).unwrap();
    assert!(said.contains("scan2.xyz  skipped       no point in this file"), "{said}");
    assert!(said.contains("5 scans, 1 accepted, 1 refused, 3 skipped: "), "{said}");
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_refused_and_not_waited_for() {
    let (folder, path) = file("scan0.xyz", b"1 0 0\n");
    let pipe = folder.path().join("scan1.xyz");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let pipe = pipe.to_str().unwrap();
    let refused = |arguments: &[&str]| {
        let said = complaint(arguments, 1);
        assert!(
            said.contains("scan1.xyz: a named pipe") && said.contains("write it to a file first"),
            "{said}"
        );
    };
    refused(&["map", &path, pipe, "--resolution", "0.1"]);
    refused(&["insert", pipe, "--map", "a", "--server", "http://127.0.0.1:9"]);
    for survey in ["a.las", "a.laz", "a.e57", "a.png"] {
        let pipe = folder.path().join(survey);
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let out = folder.path().join("a.mrol");
        let (pipe, out) = (pipe.to_str().unwrap(), out.to_str().unwrap());
        let said = match survey {
            "a.png" => complaint(&["map", pipe, "--resolution", "0.1", "--camera", "9 9 1 1"], 1),
            _ => complaint(&["import", pipe, "--resolution", "0.1", "--out", out], 1),
        };
        assert!(said.contains(survey) && said.contains("write it to"), "{said}");
    }
    let device = folder.path().join("null.xyz");
    std::os::unix::fs::symlink("/dev/null", &device).unwrap();
    let said = complaint(&["map", device.to_str().unwrap(), "--resolution", "0.1"], 1);
    assert!(said.contains("null.xyz: a device"), "{said}");
}

#[test]
fn numbers_out_of_range_are_usage_errors_that_name_the_range() {
    let (_folder, path) = file("scan.xyz", b"1 0 0\n");
    for (option, value, text) in [
        ("--resolution", "0", "resolution_m must lie in 0.001..=100"),
        ("--levels", "13", "levels must lie in 1..=12"),
        ("--filter-hashes", "11", "filter_hashes must lie in 1..=10"),
        ("--min-overlap", "2", "overlap_min must lie in 0..=1"),
        ("--first-pose", "1 2 3", "7 numbers are needed"),
        ("--first-pose", "0 0 0 0 0 0 2", "norm 2"),
        ("--sensor-height", "1001", "from -1000 to 1000 m, got 1001"),
        ("--axes", "camera", "possible values: robot, optical"),
    ] {
        let mut arguments = vec!["map", &path, option, value];
        if option != "--resolution" {
            arguments.extend(["--resolution", "0.1"]);
        }
        let complaint = complaint(&arguments, 2);
        assert!(complaint.contains(text), "{complaint}");
    }
}

#[test]
fn a_truth_with_too_few_poses_is_refused() {
    let (folder, _) = file("0.xyz", b"0 0 0\n");
    std::fs::write(folder.path().join("1.xyz"), b"0 0 0\n").unwrap();
    let truth = folder.path().join("poses.txt");
    std::fs::write(&truth, "0 0 0 0 0 0 0 1\n").unwrap();
    let arguments =
        ["map", folder.path().to_str().unwrap(), "--resolution", "1", "--truth", truth.to_str().unwrap()];
    assert!(complaint(&arguments, 1).contains("1 poses for 2 scans"));
}

#[test]
fn results_that_could_not_be_written_stop_the_run_before_it_begins() {
    let (folder, path) = file("scan.xyz", b"1 0 0\n");
    let out = folder.path().join("none/a.mrol");
    let arguments = ["map", &path, "--resolution", "1", "--out", out.to_str().unwrap()];
    assert!(complaint(&arguments, 1).contains("make it first"));
}

#[test]
fn a_server_that_does_not_run_is_named_with_what_to_do() {
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let calls: [&[&str]; 4] = [
        &["maps", "list"],
        &["maps", "show", "a"],
        &["query", "--map", "a", "--point", "0,0,0"],
        &["delete", "--map", "a", "--sphere", "0 0 0 1"],
    ];
    for call in calls {
        let complaint = complaint(&[call, &["--server", &free]].concat(), 1);
        assert!(complaint.contains(&free) && complaint.contains("is `mrol serve` running"), "{complaint}");
    }
}

#[test]
fn a_call_that_makes_no_sense_is_a_usage_error() {
    for arguments in [
        &["query", "--map", "a"][..],
        &["query", "--map", "A", "--point", "0,0,0"],
        &["query", "points.xyz", "--map", "a", "--point", "0,0,0"],
        &["delete", "--map", "a"],
        &["delete", "--map", "a", "--point", "0,0,0", "--sphere", "0 0 0 1"],
        &["delete", "--map", "a", "--box", "1 1 1 0 0 0"],
        &["insert", "a.ply", "--map", "a", "--create"],
        &["insert", "a.ply", "--map", "a", "--levels", "3"],
        &["insert", "a.ply", "--map", "a", "--at-guess"],
        &["map", "a.ply", "--resolution", "1", "--at-truth"],
        &["maps", "list", "--server", "ftp://a"],
        &["serve", "--http-listen", "nowhere"],
        &["serve", "--config", "no-such-file.toml"],
        &["serve", "--log-level", "a=b=c"],
        &["demo", "--scans", "1"],
    ] {
        complaint(arguments, 2);
    }
}

#[test]
fn a_settings_file_that_cannot_be_read_and_a_wrong_value_are_told_by_path_and_key() {
    let serve = |arguments: &[&str]| complaint(&[&["serve"], arguments].concat(), 2);
    let missing = serve(&["--config", "nofile.toml"]);
    assert!(missing.contains("nofile.toml cannot be read: No such file"), "{missing}");
    let (_folder, path) = file("mrol.toml", b"[limits]\nmaps_max = -1\n");
    let wrong = serve(&["--config", &path]);
    assert!(wrong.contains("limits.maps_max in ") && wrong.contains("mrol.toml: must be"), "{wrong}");
    let option = serve(&["--durability", "often"]);
    assert!(option.starts_with("error: store.durability: must be"), "{option}");
    let variable = mrol(&["serve"]).env("MROL_HTTP__LISTEN", "5").assert().code(2).get_output().clone();
    let variable = String::from_utf8(variable.stderr).unwrap();
    assert!(variable.starts_with("error: MROL_HTTP__LISTEN: must be an address"), "{variable}");
}

#[test]
fn an_address_that_is_taken_is_named_with_what_to_do() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let output =
        mrol(&["serve", "--data-dir", "", "--grpc-listen", "127.0.0.1:0", "--http-listen", &address])
            .assert()
            .code(1)
            .get_output()
            .clone();
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert!(complaint.contains(&address) && complaint.contains("--http-listen"), "{complaint}");
}

#[test]
fn commands_that_moved_say_where_they_went() {
    let said = complaint(&["bench", "lookup", "--structures", "exact"], 2);
    assert!(said.ends_with("cargo run --release -p mrol-lab -- bench lookup --structures exact\n"), "{said}");
    assert!(complaint(&["experiment"], 2).ends_with("-p mrol-lab -- experiment\n"));
}
