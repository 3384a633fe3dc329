//! The C library in a process of its own.

use std::path::Path;
use std::process::Stdio;

use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, Lines};
use tokio::process::{Child, ChildStdin, ChildStdout, Command};

use super::address::GrpcAddress;
use super::error::FleetError;
use super::memory::resident_bytes;
use crate::workload::Queries;
use mrol_map::geometry::{rotation_xyzw, translation_m};
use mrol_map::map::{Lookup, MapName};

/// `clients/c/benches/query.c`, with a replica of a map: it asks when it is told to.
pub(crate) struct CClient {
    child: Child,
    commands: ChildStdin,
    lines: Lines<BufReader<ChildStdout>>,
}

/// One pass over all points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CPass {
    pub(crate) ns: f64,
    pub(crate) occupied: usize,
}

impl CClient {
    /// Starts the program, which opens a replica and reads the points from a file in `folder`.
    pub(crate) async fn start(
        program: &Path,
        server: &GrpcAddress,
        map: &MapName,
        queries: &Queries,
        folder: &Path,
    ) -> Result<Self, FleetError> {
        let no_client = |error: &dyn std::fmt::Display| {
            FleetError::failed(format!("{} does not run: {error}", program.display()))
        };
        let points = folder.join("points.f32");
        std::fs::write(&points, bytemuck::cast_slice::<_, u8>(&queries.points))
            .map_err(FleetError::failed)?;
        let (t, q) = (translation_m(&queries.map_from_points), rotation_xyzw(&queries.map_from_points));
        let mut child = Command::new(program)
            .args([&server.url, map.as_str()])
            .arg(points)
            .args(t.iter().chain(&q).map(f64::to_string))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .map_err(|error| no_client(&error))?;
        let (Some(commands), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(no_client(&"it ended at once"));
        };
        let mut client = Self { child, commands, lines: BufReader::new(output).lines() };
        match client.line().await?.as_str() {
            "ready" => Ok(client),
            line => Err(no_client(&line)),
        }
    }

    /// Asks about all points, `points` at a time, twice; the second time by the clock.
    pub(crate) async fn pass(&mut self, lookup: Lookup, points: usize) -> Result<CPass, FleetError> {
        let command = format!("{} {points}\n", u8::from(lookup == Lookup::Bloom));
        self.commands.write_all(command.as_bytes()).await.map_err(FleetError::failed)?;
        let line = self.line().await?;
        let words: Option<(f64, usize)> =
            line.split_once(' ').and_then(|(ns, occupied)| Some((ns.parse().ok()?, occupied.parse().ok()?)));
        let (ns, occupied) =
            words.ok_or_else(|| FleetError::failed(format!("the C client says {line:?}")))?;
        Ok(CPass { ns, occupied })
    }

    /// Resident memory of the client, bytes.
    pub(crate) fn resident_bytes(&self) -> Result<u64, FleetError> {
        self.child.id().map_or(Ok(0), resident_bytes)
    }

    async fn line(&mut self) -> Result<String, FleetError> {
        let line = self.lines.next_line().await.map_err(FleetError::failed)?;
        line.ok_or_else(|| FleetError::failed("the C client ended"))
    }
}
