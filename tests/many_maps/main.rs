//! Many maps in one server: what small ones take of memory and threads, how soon they are served after a restart, and
//! maps that sleep while there is room for few.
//!
//! The gate takes some hundred maps. The long form, of a release build:
//!
//!     MROL_SMALL_MAPS=2000 MROL_SLEEPING_MAPS=1000 MROL_SLEEPING_VOXELS=100000 MROL_SLEEPING_SECONDS=300 \
//!         cargo test --release --test many_maps -- --nocapture --test-threads=1

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod sleeping;
mod small;
#[path = "../support/mod.rs"]
mod support;

use std::process::Command;

use mrol::client::Client;
use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::ScanRequest;
use tempfile::TempDir;

use crate::support::memory::Memory;
use crate::support::process::Process;

/// The number in a variable of the environment.
fn number_of(variable: &str, without: usize) -> usize {
    std::env::var(variable).map_or(without, |text| text.parse().expect("a number"))
}

fn name(number: usize) -> MapName {
    MapName::new(&format!("tile-{number}")).unwrap()
}

/// A server of its own, once all its maps are open.
struct Server {
    process: Process,
    memory: Memory,
    client: Client,
}

/// The command that serves the maps of `data` over HTTP at `http`, with more settings as variables.
fn serve(data: &TempDir, http: &str, settings: &[(&str, &str)]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mrol"));
    command
        .args(["serve", "--json", "--log-level", "error", "--data-dir", data.path().to_str().unwrap()])
        .args(["--http-listen", http, "--grpc-listen", "127.0.0.1:0"])
        .env("MROL_LIMITS__MAPS_MAX", "100000")
        .env("MROL_LOG__AUDIT", "false")
        .envs(settings.iter().copied());
    command
}

impl Server {
    async fn start(data: &TempDir, settings: &[(&str, &str)]) -> Self {
        let process = Process::of(serve(data, "127.0.0.1:0", settings));
        let (memory, client) = (Memory::of(process.id()), Client::connect(&process.grpc).await.unwrap());
        Self { process, memory, client }
    }
}

/// A scan at its guess, under this id.
fn scan(scan_id: u64, points: Vec<Point>) -> ScanRequest {
    ScanRequest {
        scan_id: Some(scan_id),
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("r1").unwrap(), points.into())
    }
}
