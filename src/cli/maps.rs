//! `mrol maps`: make, list, describe, rename and delete the maps of a server.

use std::fmt;
use std::fmt::Display;

use clap::Subcommand;
use serde::Serialize;

use super::confirmation::confirm_deletion;
use super::remote::ServerOptions;
use mrol::console::CliError;
use mrol::console::MapReport;
use mrol::console::Output;
use mrol::console::parse;
use mrol_client::{NewFilter, NewMap};
use mrol_map::map::{MapName, MapOrigin};
use mrol_service::{MapElsewhere, MapHolder, MapList, UnavailableMap};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol maps create office --resolution 0.05 --levels 5
  mrol maps create yard --resolution 0.1 --no-filter --no-moments
                                                 for queries, in a small part of the memory
  mrol maps create site --resolution 0.1 --origin \"388096 3948996 12\"
                                                 for scans in the coordinates of a survey
  mrol maps list
  mrol maps show office                          voxels, memory and false positives of each level
  mrol maps show office --json
  mrol maps rename office office-2024            its revision, its robots and what undo reaches stay
  mrol maps delete office
  mrol maps list --server http://robot-7:7334    MROL_SERVER sets another default";

/// Make, list, describe, rename and delete the maps of a server
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Maps {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List all maps; those that could not be opened with the reason and the remedy
    List {
        #[command(flatten)]
        server: ServerOptions,
    },
    /// Make a map; no error if a map with these settings exists
    Create {
        #[command(flatten)]
        map: Named,
        #[command(flatten)]
        settings: NewMapOptions,
    },
    /// Describe a map, level by level
    Show {
        #[command(flatten)]
        map: Named,
    },
    /// Give a map another name, which no map has
    Rename {
        /// The map's name
        #[arg(value_name = "OLD", value_parser = parse::map_name)]
        name: MapName,
        /// The name that it gets: [a-z0-9][a-z0-9_-]{0,63}
        #[arg(value_name = "NEW", value_parser = parse::map_name)]
        to: MapName,
        #[command(flatten)]
        server: ServerOptions,
    },
    /// Delete a map for good; on a terminal its name is asked for first
    Delete {
        #[command(flatten)]
        map: Named,
        /// Delete it without asking
        #[arg(long)]
        yes: bool,
    },
}

#[derive(Debug, clap::Args)]
struct Named {
    /// The map's name: [a-z0-9][a-z0-9_-]{0,63}
    #[arg(value_parser = parse::map_name)]
    name: MapName,
    #[command(flatten)]
    server: ServerOptions,
}

/// Settings of a map to make; what is not given is the server's default.
#[derive(Debug, clap::Args)]
pub(super) struct NewMapOptions {
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS")]
    resolution: f64,
    /// Where the map's origin lies in the coordinates of a survey: "x y z", meters. Kept with the map, for `--origin
    /// auto`
    #[arg(long, value_name = "X Y Z", allow_hyphen_values = true, value_parser = parse::vector)]
    origin: Option<[f64; 3]>,
    #[command(flatten)]
    rest: OptionalSettings,
}

/// Settings that the server has defaults for.
#[derive(Debug, clap::Args)]
pub(super) struct OptionalSettings {
    /// Number of levels, each twice as coarse as the one before: 1 to 12 [default: 6]
    #[arg(long)]
    levels: Option<u32>,
    /// Hash functions of the counting Bloom filters, k of eq. (1): 1 to 10
    #[arg(long, value_name = "K")]
    filter_hashes: Option<u32>,
    /// Bits of the filters' planes a voxel, m / n of eq. (1): 1 to 4096
    #[arg(long, value_name = "BITS")]
    filter_bits_per_key: Option<f64>,
    /// No filters: the exact set answers every look-up
    #[arg(long, conflicts_with_all = ["filter_hashes", "filter_bits_per_key"])]
    no_filter: bool,
    /// No moments of points: scans are aligned by overlap alone
    #[arg(long)]
    no_moments: bool,
}

impl OptionalSettings {
    /// True when at least one setting is given.
    pub(super) fn is_any(&self) -> bool {
        self.with_resolution(0.0) != NewMap::of(0.0)
    }

    pub(super) fn with_resolution(&self, resolution_m: f64) -> NewMap {
        let filter = match self.no_filter {
            true => NewFilter::NoFilter,
            false => NewFilter::Filter { hashes: self.filter_hashes, bits_per_key: self.filter_bits_per_key },
        };
        let moments = self.no_moments.then_some(false);
        NewMap { levels: self.levels, filter, moments, ..NewMap::of(resolution_m) }
    }
}

impl Maps {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        match self.action {
            Action::List { server } => list(server, output).await,
            Action::Create { map, settings } => create(map, settings, output).await,
            Action::Show { map } => {
                let info = map.server.connect().await?.map_info(&map.name).await?;
                output.print(&MapReport::from(&info))
            }
            Action::Rename { name, to, server } => {
                let info = server.connect().await?.rename_map(&name, &to).await?;
                output.print(&Renamed { renamed: name.to_string(), map: MapReport::from(&info) })
            }
            Action::Delete { map, yes } => {
                if !yes {
                    let warning = format!("Map {} goes for good, memory and files.", map.name);
                    confirm_deletion(&map.name, &warning)?;
                }
                map.server.connect().await?.delete_map(&map.name).await?;
                output.print(&Deleted { deleted: map.name.to_string() })
            }
        }
    }
}

async fn list(server: ServerOptions, output: Output) -> Result<(), CliError> {
    let MapList { maps, unavailable, elsewhere } = server.connect().await?.list_maps().await?;
    if maps.is_empty() && unavailable.is_empty() && elsewhere.is_empty() {
        output.say("no maps yet: `mrol maps create NAME --resolution 0.05` makes one")?;
    }
    maps.iter().try_for_each(|info| {
        if output.is_json() {
            output.print(&MapReport::from(info))
        } else {
            output.say(MapReport::line(info))
        }
    })?;
    unavailable.into_iter().try_for_each(|map| output.print(&Unavailable::from(map)))?;
    elsewhere.into_iter().try_for_each(|map| output.print(&Elsewhere::from(map)))
}

/// A map that other nodes of the cluster hold.
#[derive(Serialize)]
struct Elsewhere {
    map: String,
    /// The live nodes that hold it.
    held_by: Vec<String>,
}

impl From<MapElsewhere> for Elsewhere {
    fn from(MapElsewhere { name, holders }: MapElsewhere) -> Self {
        let at = |MapHolder { node, grpc, .. }| format!("{node} ({grpc})");
        Self { map: name.to_string(), held_by: holders.into_iter().map(at).collect() }
    }
}

impl Display for Elsewhere {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nodes = if self.held_by.is_empty() { "no live node".to_owned() } else { self.held_by.join(", ") };
        write!(f, "{:<24} held by {nodes}", self.map)
    }
}

/// A map that could not be opened.
#[derive(Serialize)]
struct Unavailable {
    map: String,
    unavailable: String,
}

impl From<UnavailableMap> for Unavailable {
    fn from(UnavailableMap { name, reason }: UnavailableMap) -> Self {
        Self { map: name.to_string(), unavailable: reason }
    }
}

impl Display for Unavailable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<24} UNAVAILABLE: {}; then restart the server", self.map, self.unavailable)
    }
}

async fn create(map: Named, settings: NewMapOptions, output: Output) -> Result<(), CliError> {
    let origin = settings.origin.map(MapOrigin::new).transpose().map_err(CliError::usage)?;
    let new = NewMap { origin, ..settings.rest.with_resolution(settings.resolution) };
    let (info, created) = map.server.connect().await?.create_map(&map.name, new).await?;
    output.print(&Made { created, map: MapReport::from(&info) })
}

#[derive(Serialize)]
struct Made {
    created: bool,
    #[serde(flatten)]
    map: MapReport,
}

impl Display for Made {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = if self.created { "created" } else { "was there already" };
        write!(f, "map {} {what}: {}", self.map.name(), self.map.kind())
    }
}

#[derive(Serialize)]
struct Renamed {
    renamed: String,
    #[serde(flatten)]
    map: MapReport,
}

impl Display for Renamed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "map {} is called {} now: {}", self.renamed, self.map.name(), self.map.kind())
    }
}

#[derive(Serialize)]
struct Deleted {
    deleted: String,
}

impl Display for Deleted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "map {} deleted", self.deleted)
    }
}
