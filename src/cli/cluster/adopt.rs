//! `mrol cluster adopt`: takes the maps of a server by itself into a cluster.

use std::collections::BTreeSet;
use std::fmt;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use serde::Serialize;
use tokio::runtime::Runtime;

use super::nats::{NatsOptions, engine_of};
use mrol::console::parse;
use mrol::console::{CliError, Output, bytes};
use mrol_cluster::{ClusterStore, Holders, Listing, NoStore, StreamError};
use mrol_map::map::MapName;
use mrol_service::{Adoption, MapService, MapVersion, NewMap, ServiceError, ServiceSettings};
use mrol_store::OpeningProgress;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol cluster adopt ./mrol-data --nats nats://10.0.0.1:4222,nats://10.0.0.2:4222
  mrol cluster adopt ./mrol-data --map office --map yard --config mrol.toml    these maps only
  mrol cluster adopt ./mrol-data --of-node --config mrol.toml                  NATS was lost with its disks, and is new

No server may use the folder meanwhile. Each map keeps its uuid and its revisions. All nodes hold the maps then, whatever
cluster.copies says: `mrol cluster copies` changes that. A map whose name another map of the cluster has is refused, and nothing
is done then. Done again, it goes on where it was ended. From then on the folder is for a node alone: a server by itself does not
open it, unless it is started with --leave-cluster.

Where NATS was lost with all its disks, the nodes have the maps: end all nodes, call this with --of-node for the folder of each, one after
the other, and then start them with their folders. Of each map the copy that is furthest counts, whichever folder comes first. Leave
the folder of a node out that said `histories_differ`.";

/// Take the maps of a data folder into the cluster, while no server uses the folder
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Adopt {
    /// The data folder of a server by itself
    #[arg(value_name = "DATA_DIR")]
    data_dir: PathBuf,
    /// The folder is a node's, of a cluster whose NATS was lost
    #[arg(long)]
    of_node: bool,
    /// Only this map; may be repeated
    #[arg(long = "map", value_name = "NAME", value_parser = parse::map_name)]
    maps: Vec<MapName>,
    #[command(flatten)]
    nats: NatsOptions,
}

impl Adopt {
    pub(super) fn run(self, output: Output) -> Result<(), CliError> {
        let Self { data_dir, of_node, maps, nats } = self;
        let settings = nats.settings()?;
        if !data_dir.join("maps").is_dir() {
            let folder = data_dir.display();
            return Err(CliError::usage(format!("{folder} is no data folder: it has no folder maps")));
        }
        let of_service = ServiceSettings {
            data_dir: Some(data_dir.clone()),
            adoption: Some(if of_node { Adoption::OfNode } else { Adoption::OfServer }),
            ..settings.service_settings()
        };
        let service = MapService::open(of_service, &OpeningProgress::default()).map_err(CliError::failed)?;
        let runtime = Runtime::new().map_err(CliError::failed)?;
        let (chosen, former) = chosen(&service, &maps, of_node)?;
        for name in former {
            output.say(format!(
                "map {name} is left out: it is a former copy of a map (--map {name} takes it as well)"
            ))?;
        }
        let maps = chosen.into_iter().map(|name| {
            let version = runtime.block_on(service.version_of(&name)).map_err(CliError::failed)?;
            Ok((name, version))
        });
        let maps = maps.collect::<Result<Vec<(MapName, MapVersion)>, CliError>>()?;
        let store = ClusterStore::create(&engine_of(&settings)).map_err(not_made)?;
        let (listing, _) = store.catalog.read().map_err(CliError::failed)?;
        let maps = match of_node {
            true => without_others(&listing, maps, &output)?,
            false => check_free(&listing, &maps).map(|()| maps)?,
        };
        if !of_node {
            service.note_adopted().map_err(CliError::failed)?;
        }
        let output = output.with_bar_of(maps.len(), "maps");
        let mut failed = Vec::new();
        for (name, version) in maps {
            let shared = || runtime.block_on(service.to_share(&name));
            let put = match listing.map(&name) {
                Some(_) if of_node => begun_further(&store, &name, shared()),
                Some(_) => Ok(Put::Before),
                None => entered(&store, &name, shared()).map(|bytes| Put::Now { bytes, before: None }),
            };
            match put {
                Ok(put) => output.print(&Adopted::of(&name, version, put))?,
                // Maps behind it may be in this folder alone.
                Err(error) if of_node => failed.push(error.to_string()),
                Err(error) => return Err(error),
            }
            output.step();
        }
        output.clear_bar();
        if !failed.is_empty() {
            return Err(CliError::failed(failed.join("\n")));
        }
        match of_node {
            true => output
                .say("next: the folders of the other nodes, and then start all nodes with their folders"),
            false => output.say(next_step(&data_dir, store.engine.servers())),
        }
    }
}

/// The maps that are named, or all; and those that are left out, since a node keeps former copies of maps under other
/// names.
fn chosen(
    service: &MapService,
    named: &[MapName],
    of_node: bool,
) -> Result<(Vec<MapName>, Vec<MapName>), CliError> {
    let named: BTreeSet<&MapName> = named.iter().collect();
    let is_meant = |name: &MapName| named.is_empty() || named.contains(name);
    if let Some(map) = service.unavailable_maps().into_iter().find(|map| is_meant(&map.name)) {
        return Err(CliError::failed(format!("map {} cannot be opened: {}", map.name, map.reason)));
    }
    let there = service.map_names();
    if let Some(missing) = named.iter().find(|name| !there.contains(name)) {
        return Err(CliError::failed(format!("--map: there is no map {missing} in the data folder")));
    }
    let is_former = |name: &MapName| {
        let of = name.as_str().rsplit_once("-replaced-").map(|(of, _)| of);
        of_node && !named.contains(name) && of.is_some_and(|of| there.iter().any(|map| map.as_str() == of))
    };
    Ok(there.iter().filter(|name| is_meant(name)).cloned().partition(|name| !is_former(name)))
}

/// Refuses maps whose names others have in the cluster, before anything is put.
fn check_free(listing: &Listing, maps: &[(MapName, MapVersion)]) -> Result<(), CliError> {
    for (name, MapVersion { map_uuid: uuid, .. }) in maps {
        let Some(entry) = listing.map(name).filter(|entry| entry.uuid != *uuid) else { continue };
        return Err(CliError::failed(format!(
            "map {name} of the cluster is another one ({}, this is {uuid}); nothing was done. Start the server by itself once \
             more and give this one another name (`mrol maps rename {name} NEW`), or name the others with --map",
            entry.uuid
        )));
    }
    Ok(())
}

/// The maps but those whose names others have in the cluster: a map that was deleted and made anew while the node was
/// down.
fn without_others(
    listing: &Listing,
    maps: Vec<(MapName, MapVersion)>,
    output: &Output,
) -> Result<Vec<(MapName, MapVersion)>, CliError> {
    let is_other = |(name, version): &(MapName, MapVersion)| {
        listing.map(name).is_some_and(|entry| entry.uuid != version.map_uuid)
    };
    let (others, maps): (Vec<_>, Vec<_>) = maps.into_iter().partition(is_other);
    for (name, version) in others {
        output.say(format!(
            "map {name} is left out: that of the folder is {}, and the cluster has another one by now. If this is the right one, \
             begin anew with an empty NATS and this folder",
            version.map_uuid
        ))?;
    }
    Ok(maps)
}

/// Enters a map, and says how many bytes were put.
fn entered(
    store: &ClusterStore,
    name: &MapName,
    new: Result<NewMap, ServiceError>,
) -> Result<usize, CliError> {
    let failed = |why: &dyn Display| {
        CliError::failed(format!(
            "map {name} was not entered: {why}. Those before it are in the cluster; the same command goes on with this one"
        ))
    };
    let new = new.map_err(|error| failed(&error))?;
    match store.enter(name, &new, &Holders::All).map_err(|error| failed(&error))? {
        there if there == new.uuid => Ok(new.file.len()),
        other => Err(failed(&format!("another of that name was entered meanwhile, {other}"))),
    }
}

/// Puts the copy of another node in the place of one that is not as far.
fn begun_further(
    store: &ClusterStore,
    name: &MapName,
    new: Result<NewMap, ServiceError>,
) -> Result<Put, CliError> {
    let failed = |why: &dyn Display| CliError::failed(format!("map {name} is as it was: {why}"));
    let new = new.map_err(|error| failed(&error))?;
    let before = store.begin_further(&new).map_err(|error| failed(&error))?;
    match before < new.base.revision {
        true => Ok(Put::Now { bytes: new.file.len(), before: Some(before) }),
        false => Ok(Put::Before),
    }
}

fn not_made(error: NoStore) -> CliError {
    match error {
        NoStore::Connect(error) => CliError::failed(error),
        NoStore::Stream(error @ StreamError::Missing(_)) => CliError::failed(error),
        NoStore::Stream(error) => CliError::failed(format!(
            "{error}; each stream is kept on as many NATS servers as cluster.replicas says (MROL_CLUSTER__REPLICAS=1 for a \
             NATS server by itself)"
        )),
    }
}

/// What is to be done next.
fn next_step(data_dir: &Path, servers: &str) -> String {
    let (servers, folder) = (servers.replace(", ", ","), data_dir.display());
    format!(
        "next: start the server of this folder as a node:\n  \
         mrol serve --cluster {servers} --node NAME --data-dir {folder}"
    )
}

/// What was put of a map.
enum Put {
    /// Nothing: it was there.
    Before,
    /// So many bytes, in the place of a copy of the revision `before`, if there was one.
    Now { bytes: usize, before: Option<u64> },
}

#[derive(Serialize)]
struct Adopted {
    map: String,
    map_uuid: String,
    revision: u64,
    /// Bytes that were put; none of a map that was in the cluster already.
    bytes: Option<usize>,
    /// Revision of the copy of another node that this one took the place of.
    in_place_of: Option<u64>,
}

impl Adopted {
    fn of(name: &MapName, version: MapVersion, put: Put) -> Self {
        let (map, map_uuid) = (name.to_string(), version.map_uuid.to_string());
        let (bytes, in_place_of) = match put {
            Put::Before => (None, None),
            Put::Now { bytes, before } => (Some(bytes), before),
        };
        Self { map, map_uuid, revision: version.revision, bytes, in_place_of }
    }
}

impl Display for Adopted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { map, map_uuid, revision, .. } = self;
        let Some(size) = self.bytes.map(bytes) else {
            return write!(f, "map {map} ({map_uuid}) is in the cluster already");
        };
        write!(f, "map {map} ({map_uuid}) is in the cluster now, at revision {revision}")?;
        if let Some(before) = self.in_place_of {
            write!(f, " in the place of {before}")?;
        }
        write!(f, ": {size} were put")
    }
}
