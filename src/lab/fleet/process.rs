//! A server in a process of its own, so that its memory is its own.

use std::path::Path;
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};
use serde::Deserialize;
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{Child, Command};
use tokio::time::timeout;

use super::FleetError;
use super::address::{GrpcAddress, HttpAddress};
use super::memory::resident_bytes;

/// How long it may take to go down, beyond the ten seconds of its drain.
const STOPPING_MAX: Duration = Duration::from_secs(30);

/// Revisions within which undo works: missions are short, and more would fill the disk.
const UNDO_REVISIONS: &str = "1000";

/// This same program as a daemon, on free ports. It is killed where it was not stopped.
pub(crate) struct ServerProcess {
    child: Child,
    pid: u32,
    serving: Serving,
}

/// What it prints first.
#[derive(Deserialize)]
struct Serving {
    http: String,
    grpc: String,
}

impl ServerProcess {
    /// Starts it with its maps in `data_dir`.
    pub(crate) async fn start(data_dir: &Path) -> Result<Self, FleetError> {
        let no_server = |error: &dyn std::fmt::Display| FleetError::failed(format!("no server: {error}"));
        let program = std::env::current_exe().map_err(|error| no_server(&error))?;
        let mut child = Command::new(program)
            .args(["serve", "--json", "--log-level", "warn"])
            .args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0", "--data-dir"])
            .arg(data_dir)
            .env("MROL_STORE__UNDO_REVISIONS", UNDO_REVISIONS)
            .stdout(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .map_err(|error| no_server(&error))?;
        let mut line = String::new();
        let (Some(pid), Some(output)) = (child.id(), child.stdout.take()) else {
            return Err(no_server(&"it ended at once"));
        };
        BufReader::new(output).read_line(&mut line).await.map_err(|error| no_server(&error))?;
        let serving = serde_json::from_str(&line).map_err(|error| no_server(&error))?;
        Ok(Self { child, pid, serving })
    }

    /// The server's gRPC address.
    pub(crate) fn grpc(&self) -> GrpcAddress {
        GrpcAddress::open(&self.serving.grpc)
    }

    /// The server's HTTP address.
    pub(crate) fn http(&self) -> HttpAddress {
        HttpAddress::open(format!("http://{}", self.serving.http))
    }

    /// Memory that it has resident.
    pub(crate) fn resident_bytes(&self) -> Result<u64, FleetError> {
        resident_bytes(self.pid)
    }

    /// Tells it to end as a service manager does, and sees that it does so well.
    pub(crate) async fn stop(mut self) -> Result<(), FleetError> {
        if let Some(pid) = i32::try_from(self.pid).ok().and_then(Pid::from_raw) {
            kill_process(pid, Signal::TERM).map_err(FleetError::failed)?;
        }
        let ended = timeout(STOPPING_MAX, self.child.wait()).await;
        let ended = ended.map_err(|_| FleetError::failed("the server does not end"))?;
        match ended.map_err(FleetError::failed)? {
            status if status.success() => Ok(()),
            status => Err(ended_badly(status)),
        }
    }
}

fn ended_badly(status: ExitStatus) -> FleetError {
    FleetError::failed(format!("the server ended with {status}"))
}
