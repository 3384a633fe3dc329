//! `mrol snapshot` and `mrol restore`: backs up the maps of a server, and restores them.

use std::fmt;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::remote::ServerOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol::console::{bytes, count};
use mrol_client::Client;
use mrol_map::map::MapName;
use mrol_service::{MapList, UnavailableMap};
use mrol_store::{Disk, Snapshot};

const SNAPSHOT_EXAMPLES: &str = "\
EXAMPLES:
  mrol snapshot --all backup/                    every map of the server, as backup/NAME.mrol; the same as without --all
  mrol snapshot backup/ --map office --map lab
  mrol snapshot backup/ --server http://robot-7:7334

Of a node of a cluster, --all takes the maps that other nodes hold from those.

Each file is a map at one revision, with its trajectory and the ids that it has accepted; the server goes on working.
A file is checked before it replaces an older one. Where the server has maps that it could not open, the command saves
the others, names the missing ones, and fails. A key of scope read is enough. `mrol restore` restores maps, on this
server or another; so does putting a file into DATA_DIR/maps of a server that is down.";

const RESTORE_EXAMPLES: &str = "\
EXAMPLES:
  mrol restore backup/office.mrol                as map office
  mrol restore backup/*.mrol --server http://robot-8:7334
  mrol restore backup/office.mrol --map office-before
  mrol restore backup/office.mrol --replace      in the place of map office, which is kept under another name

A restored map has a uuid of its own, since its history may go on otherwise. There must be no map of that name, but with
--replace: the map that was there is kept as NAME-replaced-REVISION until somebody deletes it, and at every moment, also
of a crash, there is one map of the name. Several files are restored one after another; the first that fails ends it, and
those before it stay restored.

A map has the name of its file, without .mrol, unless --map says otherwise. It takes a key of scope admin, with --replace one
for all maps.";

/// Back up maps of a running server, as files
#[derive(Debug, clap::Args)]
#[command(name = "snapshot", after_help = SNAPSHOT_EXAMPLES)]
pub(super) struct TakeSnapshots {
    /// Folder for the files; created if it does not exist
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Every map of the server: the default where no map is named
    #[arg(long, conflicts_with = "maps")]
    all: bool,
    /// Only this map; may be repeated
    #[arg(long = "map", value_name = "NAME", value_parser = parse::map_name)]
    maps: Vec<MapName>,
    #[command(flatten)]
    server: ServerOptions,
}

/// Restore maps to a running server, from files
#[derive(Debug, clap::Args)]
#[command(after_help = RESTORE_EXAMPLES)]
pub(super) struct Restore {
    /// Map files, as `mrol snapshot` and `mrol map` write them; NAME.mrol becomes map NAME
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Another name for the map than its file's; with one file only
    #[arg(long = "map", value_name = "NAME", value_parser = parse::map_name)]
    map: Option<MapName>,
    /// Replace the map of that name, if there is one; it is kept as NAME-replaced-REVISION until it is deleted
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    server: ServerOptions,
}

impl TakeSnapshots {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let client = self.server.connect().await?;
        let (names, unavailable) = match self.all || self.maps.is_empty() {
            true => {
                let MapList { maps, unavailable, elsewhere } = client.list_maps().await?;
                let here = maps.into_iter().map(|info| info.name);
                (here.chain(elsewhere.into_iter().map(|map| map.name)).collect(), unavailable)
            }
            false => (self.maps, Vec::new()),
        };
        std::fs::create_dir_all(&self.folder).map_err(CliError::writing(&self.folder))?;
        let output = output.with_bar_of(names.len(), "maps");
        for name in names {
            output.print(&take(&client, &name, &self.folder).await?)?;
            output.step();
        }
        output.clear_bar();
        not_all(&unavailable)
    }
}

/// Reports the maps that are missing in a backup of all maps.
fn not_all(unavailable: &[UnavailableMap]) -> Result<(), CliError> {
    if unavailable.is_empty() {
        return Ok(());
    }
    let missing = unavailable.iter().map(|UnavailableMap { name, reason }| format!("map {name}: {reason}"));
    let missing: Vec<String> = missing.collect();
    let message = format!("the backup lacks what the server could not open: {}", missing.join("; "));
    Err(CliError::failed(message))
}

async fn take(client: &Client, name: &MapName, folder: &Path) -> Result<Saved, CliError> {
    let file = client.snapshot_map(name).await?;
    let path = folder.join(format!("{name}.mrol"));
    let damaged =
        |reason| CliError::failed(format!("what the server sent of map {name} is no map: {reason}"));
    let snapshot = Snapshot::decode(&file).map_err(damaged)?;
    snapshot.write(&Disk::default(), &path)?;
    let (revision, voxels) = (snapshot.contents.revision, snapshot.contents.voxels.len());
    Ok(Saved { map: name.to_string(), file: path.display().to_string(), revision, voxels, bytes: file.len() })
}

impl Restore {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        if self.map.is_some() && self.files.len() > 1 {
            return Err(CliError::usage(format!(
                "--map names one map, and {} files are given",
                self.files.len()
            )));
        }
        let client = self.server.connect().await?;
        let output = output.with_bar_of(self.files.len(), "maps");
        for path in &self.files {
            let name = self.map.clone().map_or_else(|| name_of(path), Ok)?;
            let unreadable = |error| CliError::failed(format!("{}: {error}", path.display()));
            let file = std::fs::read(path).map_err(unreadable)?;
            let info = match self.replace {
                true => client.replace_map(&name, file.into()).await?,
                false => client.restore_map(&name, file.into()).await?,
            };
            let voxels = info.levels.first().map_or(0, |level| level.voxels);
            output.print(&Restored { map: name.to_string(), revision: info.version.revision, voxels })?;
            output.step();
        }
        output.clear_bar();
        Ok(())
    }
}

/// The name of the map, from the name of its file.
fn name_of(path: &Path) -> Result<MapName, CliError> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    MapName::new(&stem)
        .map_err(|error| CliError::usage(format!("{}: {error}; --map names it", path.display())))
}

#[derive(Serialize)]
struct Saved {
    map: String,
    file: String,
    revision: u64,
    voxels: usize,
    bytes: usize,
}

impl Display for Saved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { map, file, revision, .. } = self;
        let (voxels, size) = (count(self.voxels), bytes(self.bytes));
        write!(f, "map {map} at revision {revision}, {voxels} voxels, {size}: {file}")
    }
}

#[derive(Serialize)]
struct Restored {
    map: String,
    revision: u64,
    voxels: usize,
}

impl Display for Restored {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "map {} restored at revision {}, {} voxels", self.map, self.revision, count(self.voxels))
    }
}
