//! A server in a process of its own, so that its memory is its own.

use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};
use serde::Deserialize;
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{Child, Command};
use tokio::time::timeout;

use super::address::{GrpcAddress, HttpAddress};
use super::cpu::cpu_seconds;
use super::error::FleetError;
use super::memory::resident_bytes;

/// Longest time for the server to end, beyond the ten seconds of its drain.
const STOPPING_MAX: Duration = Duration::from_secs(30);

/// Undo window of the server: missions are short, and more revisions would fill the disk.
const UNDO_REVISIONS: &str = "1000";

/// A free port of this machine alone.
pub(crate) const ANY_PORT: &str = "127.0.0.1:0";

/// This program as a daemon in another process, on free ports. It is killed when dropped without a stop.
pub(crate) struct ServerProcess {
    child: Child,
    pid: u32,
    serving: Serving,
}

/// The first line that the daemon prints.
#[derive(Deserialize)]
struct Serving {
    http: String,
    grpc: String,
}

impl ServerProcess {
    /// Starts the server with its maps in `data_dir`.
    pub(crate) async fn start(data_dir: &Path) -> Result<Self, FleetError> {
        Self::start_at(data_dir, ANY_PORT, &[]).await
    }

    /// Starts the server with more settings, on some processors only where there are some, as `taskset -c` names them.
    pub(crate) async fn start_on(
        processors: Option<&str>,
        data_dir: &Path,
        settings: &[(&str, &str)],
    ) -> Result<Self, FleetError> {
        let command = match processors {
            Some(processors) => {
                let mut command = Command::new("taskset");
                command.args(["-c", processors]).arg(own_program()?);
                command
            }
            None => Command::new(own_program()?),
        };
        Self::launch(command, data_dir, ANY_PORT, settings).await
    }

    /// Starts the server at an address of gRPC, with more settings: variables with their values.
    pub(crate) async fn start_at(
        data_dir: &Path,
        grpc: &str,
        settings: &[(&str, &str)],
    ) -> Result<Self, FleetError> {
        Self::launch(Command::new(own_program()?), data_dir, grpc, settings).await
    }

    /// Starts `program`, this one where none is given, as a server with more settings.
    pub(crate) async fn start_program(
        program: Option<&Path>,
        data_dir: &Path,
        settings: &[(&str, &str)],
    ) -> Result<Self, FleetError> {
        let program = program.map_or_else(own_program, |program| Ok(program.to_owned()))?;
        Self::launch(Command::new(program), data_dir, ANY_PORT, settings).await
    }

    async fn launch(
        mut command: Command,
        data_dir: &Path,
        grpc: &str,
        settings: &[(&str, &str)],
    ) -> Result<Self, FleetError> {
        let mut child = command
            .args(["serve", "--json", "--log-level", "warn"])
            .args(["--http-listen", ANY_PORT, "--grpc-listen", grpc, "--data-dir"])
            .arg(data_dir)
            .env("MROL_STORE__UNDO_REVISIONS", UNDO_REVISIONS)
            // Who changes the maps is known, and how often they do.
            .env("MROL_LOG__AUDIT", "false")
            .envs(settings.iter().copied())
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

    /// Where the server listens for gRPC, as an address without a scheme.
    pub(crate) fn grpc_listen(&self) -> &str {
        &self.serving.grpc
    }

    /// Processor time that the server has used, seconds of one core.
    pub(crate) fn cpu_seconds(&self) -> Result<f64, FleetError> {
        cpu_seconds(self.pid)
    }

    /// Ends the server at once, as `kill -9` does.
    pub(crate) async fn kill(&mut self) -> Result<(), FleetError> {
        self.child.kill().await.map_err(FleetError::failed)
    }

    /// Resident memory of the server, bytes.
    pub(crate) fn resident_bytes(&self) -> Result<u64, FleetError> {
        resident_bytes(self.pid)
    }

    /// Stops the server as a service manager does, and checks its exit code.
    pub(crate) async fn stop(&mut self) -> Result<(), FleetError> {
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

/// This program.
pub(super) fn own_program() -> Result<PathBuf, FleetError> {
    std::env::current_exe().map_err(|error| no_server(&error))
}

fn no_server(error: &dyn std::fmt::Display) -> FleetError {
    FleetError::failed(format!("no server: {error}"))
}

fn ended_badly(status: ExitStatus) -> FleetError {
    FleetError::failed(format!("the server ended with {status}"))
}
