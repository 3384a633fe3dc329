//! The real program on a disk whose writes hang, under load of every operation: `/livez` and queries are answered
//! meanwhile, on the map whose disk hangs too, and nothing outlives its deadline.
//!
//! CI takes half a minute, and asks for answers within 2 s. The long form takes percentiles, at a load of some 70 % of
//! the cores, of a release build:
//!
//!     cargo build --release && MROL_BIN=target/release/mrol MROL_STUCK_DISK_SECONDS=600 \
//!         cargo test --release --test stuck_disk -- --nocapture

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod calls;
mod keep_outs;
mod load;
mod made_again;
mod pace;
mod plain;
mod prober;
mod report;
mod requests;
#[path = "../support/mod.rs"]
mod support;

use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use load::Load;
use prober::Prober;
use report::Report;

use crate::support::disk::Disk;
use crate::support::process::Process;
use crate::support::skipped::skipped;
use crate::support::watchdog::Watchdog;

/// Of these two maps the disk of one hangs at times, that of the other only where the whole disk does.
const MAPS: [&str; 2] = ["hung", "free"];
/// How long `/livez` and queries may take.
const ANSWER_MAX: Duration = Duration::from_secs(2);
/// How much longer than its deadline a call may take.
const LATE_MAX: Duration = Duration::from_secs(1);
/// How long the prober may be without an answer.
const STILL_MAX: Duration = Duration::from_secs(20);
/// What is meant of the paths below the data folder: a map's files, snapshots of all maps, journals, everything.
const PARTS: [&str; 4] = ["/hung", "snapshot-", "journal-", ""];
const LIVEZ_P999_MAX: Duration = Duration::from_millis(50);
const QUERY_P999_MAX: Duration = Duration::from_millis(200);

/// How long the disk hangs, and how long it works in between.
struct Times {
    total: Duration,
    hangs: Duration,
    works: Duration,
    is_long: bool,
}

impl Times {
    fn of_environment() -> Self {
        let long = std::env::var("MROL_STUCK_DISK_SECONDS").ok();
        let seconds = |s: f64| Duration::from_secs_f64(s);
        match long.map(|text| text.parse().expect("seconds")) {
            Some(total) => {
                Self { total: seconds(total), hangs: seconds(10.0), works: seconds(5.0), is_long: true }
            }
            None => Self { total: seconds(26.0), hangs: seconds(5.0), works: seconds(1.5), is_long: false },
        }
    }
}

fn server(disk: &Disk) -> Process {
    let program = std::env::var("MROL_BIN").unwrap_or_else(|_| env!("CARGO_BIN_EXE_mrol").to_owned());
    let mut command = Command::new(program);
    command
        .args(["serve", "--json", "--log-level", "error", "--data-dir"])
        .arg(disk.folder())
        .args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"])
        .args(["--snapshot-journal-mib", "1", "--snapshot-interval-s", "2"])
        .stderr(Stdio::inherit());
    disk.preload(&mut command);
    Process::of(command)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_disk_that_hangs_keeps_nobody_from_being_answered() {
    let Some(disk) = Disk::build() else {
        skipped("there is no `cc` to build a disk that hangs with");
        return;
    };
    let (times, server) = (Times::of_environment(), server(&disk));
    let watchdog = Watchdog::begin(server.id(), STILL_MAX);
    let report = Arc::new(Report::default());
    let load = Load::begin(&server.http, &server.grpc, Arc::clone(&report), times.is_long).await;
    let prober = Prober::begin(&server.http, Arc::clone(&report), watchdog.heart());

    let start = Instant::now();
    for part in PARTS.iter().cycle() {
        tokio::time::sleep(times.works).await;
        if start.elapsed() >= times.total {
            break;
        }
        let waited_before = report.answers();
        disk.hang(part);
        tokio::time::sleep(times.hangs).await;
        disk.go_on();
        println!("{part:?} hung: {} answers meanwhile", report.answers() - waited_before);
    }
    load.end().await;
    prober.end();
    drop(watchdog);
    println!("{report}");
    assert_eq!(server.stop(), Some(0));
    report.assert_answered(ANSWER_MAX, LATE_MAX);
    if times.is_long {
        report.assert_percentiles(LIVEZ_P999_MAX, QUERY_P999_MAX);
    }
}
