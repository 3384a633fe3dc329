//! `mrol cluster keep`: where histories differ, one node's copy becomes the map.

use std::fmt;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::time::Duration;

use bytes::Bytes;
use serde::Serialize;
use tokio::runtime::Runtime;

use super::nats::NatsOptions;
use crate::cli::confirmation::confirm_deletion;
use mrol::console::{CliError, CredentialOptions, Output, place_of_map_file};
use mrol::console::{count, parse};
use mrol_client::{Client, ClientError};
use mrol_cluster::{Overview, SeenNode};
use mrol_map::map::MapName;
use mrol_service::replication::NodeName;
use mrol_service::{MapInfo, Reason};
use mrol_store::{Disk, Snapshot};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol cluster keep n2 office --config mrol.toml --key-file admin.key
  mrol cluster keep n2 office --out office.mrol --yes --nats nats://10.0.0.1:4222

Takes a map file from the node's own copy, keeps it, deletes the map on all nodes and restores the file under the same name. What
only other copies have is lost to the map, so look first (`mrol snapshot --server URL-OF-NODE`). The map begins anew: it has a new
uuid, undo does not reach behind, and request ids of before mean nothing to it. Revisions and trajectories stay. It is held by
the node and as many others as cluster.copies says there: `mrol cluster copies` changes that.";

/// Where histories differ: make one node's copy the map, on all nodes
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Keep {
    /// The node whose copy becomes the map
    #[arg(value_name = "NODE", value_parser = parse::node_name)]
    node: NodeName,
    /// The map
    #[arg(value_name = "MAP", value_parser = parse::map_name)]
    map: MapName,
    /// Where the node's copy is kept as a map file, which stays there [default: MAP-kept-REVISION.mrol]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Do it without asking for the map's name
    #[arg(long)]
    yes: bool,
    #[command(flatten)]
    nats: NatsOptions,
    #[command(flatten)]
    credentials: CredentialOptions,
}

/// How often the map is restored where NATS does not answer, and the pause between.
const ATTEMPTS: u32 = 5;
const PAUSE: Duration = Duration::from_secs(2);

impl Keep {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let Self { node, map, out, yes, nats, credentials } = self;
        let credentials = credentials.read()?;
        let seen = nats.reader()?.settled().map_err(CliError::failed)?;
        let server = address(&seen, &node, &map)?.to_owned();
        let runtime = Runtime::new().map_err(CliError::failed)?;
        let client = runtime.block_on(Client::connect_with(&server, &credentials))?.not_sent_on();
        let file = runtime.block_on(client.snapshot_map(&map))?;
        let (path, revision) = keep_file(&file, &map, out)?;
        let shown = path.display();
        output.note(format!("the copy of node {node}, at revision {revision}, is kept in {shown}"));
        if !yes {
            let warning = format!("Map {map} goes on all nodes, and what is in {shown} takes its place.");
            confirm_deletion(&map, &warning)?;
        }
        runtime.block_on(client.delete_map(&map)).map_err(|error| {
            let again = "where it is there still, the same command again; where it is gone";
            CliError::failed(format!(
                "map {map} was not deleted: {error}; {again}, {}",
                restoring(&path, &map, &server)
            ))
        })?;
        let info = runtime.block_on(restore(&client, &map, &file)).map_err(|error| {
            let how = restoring(&path, &map, &server);
            CliError::failed(format!("map {map} is deleted, and was not restored: {error}; {how}"))
        })?;
        output.print(&Kept::of(&node, &path, &info))
    }
}

/// The gRPC address of a live node that has a copy of a listed map.
fn address<'a>(seen: &'a Overview, node: &NodeName, map: &MapName) -> Result<&'a str, CliError> {
    let of_map =
        seen.map(map).ok_or_else(|| CliError::failed(format!("map {map} is none of the cluster's")))?;
    match seen.node(node) {
        None => Err(CliError::failed(format!(
            "node {node} is none of the cluster's: `mrol cluster status` lists them"
        ))),
        Some(SeenNode { is_live: false, .. }) => {
            Err(CliError::failed(format!("node {node} is silent: start it, since its copy is wanted")))
        }
        Some(_) if of_map.copy(node).is_none() => {
            Err(CliError::failed(format!("node {node} has no copy of map {map} that follows its log")))
        }
        Some(seen) => Ok(&seen.beat.grpc),
    }
}

/// Writes the file, once it is known to be a map; where it lies, and the map's revision.
fn keep_file(file: &Bytes, map: &MapName, out: Option<PathBuf>) -> Result<(PathBuf, u64), CliError> {
    let damaged = |reason| CliError::failed(format!("what the node sent of map {map} is no map: {reason}"));
    let snapshot = Snapshot::decode(file).map_err(damaged)?;
    let revision = snapshot.contents.revision;
    let place = match out {
        Some(path) => place_of_map_file(&path)?,
        None => {
            let path = PathBuf::from(format!("{map}-kept-{revision}.mrol"));
            // The copy of another node may be at the same revision.
            if path.exists() && Snapshot::read(&Disk::default(), &path).ok().as_ref() != Some(&snapshot) {
                let path = path.display();
                return Err(CliError::failed(format!(
                    "{path} is there and is another copy: name a file with --out"
                )));
            }
            path
        }
    };
    snapshot.write(&Disk::default(), &place)?;
    Ok((place, revision))
}

/// The command that restores the file.
fn restoring(path: &Path, map: &MapName, server: &str) -> String {
    format!("`mrol restore {} --map {map} --server {server}` restores it", path.display())
}

/// Restores the file, again where NATS did not answer and nothing was changed.
async fn restore(client: &Client, map: &MapName, file: &Bytes) -> Result<MapInfo, ClientError> {
    for _ in 1..ATTEMPTS {
        match client.restore_map(map, file.clone()).await {
            Err(error) if error.reason() == Some(Reason::NoQuorum.as_str()) => {
                tokio::time::sleep(PAUSE).await
            }
            outcome => return outcome,
        }
    }
    client.restore_map(map, file.clone()).await
}

#[derive(Serialize)]
struct Kept {
    map: String,
    node: String,
    map_uuid: String,
    revision: u64,
    voxels: usize,
    file: String,
}

impl Kept {
    fn of(node: &NodeName, path: &Path, info: &MapInfo) -> Self {
        Self {
            map: info.name.to_string(),
            node: node.to_string(),
            map_uuid: info.version.map_uuid.to_string(),
            revision: info.version.revision,
            voxels: info.levels.first().map_or(0, |level| level.voxels),
            file: path.display().to_string(),
        }
    }
}

impl Display for Kept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { map, node, map_uuid, revision, voxels, file } = self;
        write!(
            f,
            "map {map} is the copy of node {node} now: revision {revision}, {} voxels, uuid {map_uuid}. Undo and request ids \
             begin anew; {file} can go once all is well",
            count(*voxels)
        )
    }
}
