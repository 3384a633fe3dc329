//! `mrol cluster copies`: says which nodes hold a map, and waits until they do.

use std::collections::BTreeSet;
use std::fmt;
use std::fmt::Display;
use std::thread;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::known::{known_map, known_node};
use super::nats::NatsOptions;
use mrol::console::parse;
use mrol::console::{CliError, Output};
use mrol_cluster::{Holders, Overview, OverviewReader};
use mrol_map::map::MapName;
use mrol_service::replication::NodeName;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol cluster copies office n1,n3 --nats nats://10.0.0.1:4222    nodes n1 and n3 hold map office, and no others
  mrol cluster copies office all --config mrol.toml      all nodes hold it, those that join later too

Nodes that are new load the map and follow it. A node that is named no more goes on until all live ones that are named are as
far as it is: then it gives the lead away and drops its copy. So nothing is lost, and a map may be moved while robots change it.
Requests that come to a node without a copy are sent on to one that has it. The command waits for the new copies, and not until
others are dropped, which takes some beats more.";

/// How often it is looked who has a copy.
const LOOKED_EVERY: Duration = Duration::from_millis(250);

/// Say which nodes hold a map, and wait until they do
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct SetCopies {
    /// The map
    #[arg(value_name = "MAP", value_parser = parse::map_name)]
    map: MapName,
    /// The nodes that hold it, with commas between them, or `all`
    #[arg(value_name = "NODES", value_parser = holders)]
    nodes: Holders,
    /// How long to wait until the live nodes have copies: 20s, 2m
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse::duration)]
    wait: Duration,
    #[command(flatten)]
    nats: NatsOptions,
}

impl SetCopies {
    pub(super) fn run(self, output: Output) -> Result<(), CliError> {
        let Self { map, nodes, wait, nats } = self;
        let reader = nats.reader()?;
        check_known(&reader.settled().map_err(CliError::failed)?, &map, &nodes)?;
        if !reader.store().catalog.set_holders(&map, &nodes).map_err(CliError::failed)? {
            return Err(CliError::failed(format!("map {map} was deleted meanwhile")));
        }
        let output = output.with_spinner();
        let held = wait_for_copies(&reader, &map, &nodes, wait, &output);
        output.clear_bar();
        held?;
        output
            .print(&Copies { map: map.to_string(), nodes: nodes.names().map(ToString::to_string).collect() })
    }
}

/// The nodes that a text names; `all` is no name of one here.
fn holders(text: &str) -> Result<Holders, String> {
    if text == "all" {
        return Ok(Holders::All);
    }
    let nodes: BTreeSet<NodeName> = text.split(',').map(parse::node_name).collect::<Result<_, _>>()?;
    Ok(Holders::Only(nodes))
}

/// Refuses a map that is not listed, nodes that nobody has heard of, and nodes none of which is live.
fn check_known(seen: &Overview, map: &MapName, nodes: &Holders) -> Result<(), CliError> {
    known_map(seen, map)?;
    let named = nodes.names().map(|node| known_node(seen, node)).collect::<Result<Vec<_>, _>>()?;
    if !named.is_empty() && named.iter().all(|node| !node.is_live) {
        return Err(CliError::failed(format!(
            "none of the nodes {nodes} is live: map {map} would take no changes. Start one, or name one that is live \
             (`mrol cluster status`)"
        )));
    }
    Ok(())
}

/// Waits until the beats say that all live nodes that are to hold the map have a copy.
fn wait_for_copies(
    reader: &OverviewReader,
    map: &MapName,
    nodes: &Holders,
    patience: Duration,
    output: &Output,
) -> Result<(), CliError> {
    let begun = Instant::now();
    loop {
        let lacking = lacking(&reader.look().map_err(CliError::failed)?, map, nodes);
        if lacking.is_empty() {
            return Ok(());
        }
        let lacking = lacking.join(", ");
        if begun.elapsed() >= patience {
            return Err(CliError::failed(format!(
                "map {map} has no copy yet at: {lacking}, after {} s. They go on (`mrol cluster status` shows it), and the nodes \
                 that hold it no more keep theirs until then",
                patience.as_secs()
            )));
        }
        output.tell(format!("no copy yet at: {lacking}"));
        thread::sleep(LOOKED_EVERY);
    }
}

/// The live nodes that are to hold a map and have no copy that follows its log.
fn lacking(seen: &Overview, map: &MapName, nodes: &Holders) -> Vec<String> {
    let has_copy = |node: &NodeName| {
        let copy = seen.map(map).and_then(|map| map.copy(node));
        copy.is_some_and(|copy| !copy.head.is_parted)
    };
    let wanted = seen.nodes.iter().filter(|seen| seen.is_live && nodes.contains(&seen.node));
    wanted.filter(|seen| !has_copy(&seen.node)).map(|seen| seen.node.to_string()).collect()
}

#[derive(Serialize)]
struct Copies {
    map: String,
    /// None where all nodes hold it.
    nodes: Vec<String>,
}

impl Display for Copies {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.nodes.is_empty() {
            true => write!(f, "map {}: all nodes hold it", self.map),
            false => write!(f, "map {}: held by {}", self.map, self.nodes.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use mrol_cluster::{Beat, MapCopy, MapHead, SeenMap, SeenNode};
    use uuid::Uuid;

    use super::*;

    /// Nodes: name, whether it is live, whether it has a copy of map `hall`, whether that has parted.
    fn overview(nodes: &[(&str, bool, bool, bool)]) -> Overview {
        let name = |name: &str| NodeName::new(name).unwrap();
        let beat = Beat::default();
        let copy = |&(node, is_live, has_copy, is_parted): &(&str, bool, bool, bool)| {
            let head = MapHead {
                revision: 1,
                epoch: 1,
                claim: None,
                sequence: 1,
                leads: false,
                is_parted,
                agrees: true,
            };
            has_copy.then(|| MapCopy { node: name(node), is_live, head })
        };
        let copies = nodes.iter().filter_map(copy).collect();
        let seen = |&(node, is_live, ..): &(&str, bool, bool, bool)| SeenNode {
            node: name(node),
            is_live,
            beat: beat.clone(),
        };
        let (map, uuid, holders) = (MapName::new("hall").unwrap(), Uuid::nil(), Holders::All);
        let map = SeenMap { name: map, uuid, wished: None, holders, copies };
        Overview { nodes: nodes.iter().map(seen).collect(), maps: vec![map] }
    }

    #[test]
    fn nodes_are_named_with_commas_or_all_of_them() {
        assert_eq!(holders("all"), Ok(Holders::All));
        assert_eq!(holders("n2,n1").unwrap().to_string(), "n1,n2");
        assert!(holders("n1,").is_err() && holders("n 1").is_err() && holders("").is_err());
    }

    #[test]
    fn nodes_that_are_not_there_do_not_hold_a_map() {
        let seen = overview(&[("a", true, true, false), ("b", false, false, false)]);
        let refused = |map: &str, nodes: &str| {
            let checked = check_known(&seen, &MapName::new(map).unwrap(), &holders(nodes).unwrap());
            checked.map_err(|error| error.to_string())
        };
        assert_eq!(
            (refused("hall", "a"), refused("hall", "a,b"), refused("hall", "all")),
            (Ok(()), Ok(()), Ok(()))
        );
        assert_eq!(refused("yard", "a").unwrap_err(), "map yard is none of the cluster's, which are: hall");
        assert_eq!(refused("hall", "a,z").unwrap_err(), "node z is none of the cluster's, which are: a, b");
        assert!(refused("hall", "b").unwrap_err().starts_with("none of the nodes b is live"));
    }

    #[test]
    fn live_nodes_without_a_copy_are_waited_for() {
        let map = MapName::new("hall").unwrap();
        let nodes = [("a", true, true, false), ("b", true, false, false), ("c", true, true, true)];
        let of = |nodes_held: &str| lacking(&overview(&nodes), &map, &holders(nodes_held).unwrap());
        assert!(of("a").is_empty());
        assert_eq!(of("a,b"), ["b"]);
        assert_eq!(of("all"), ["b", "c"]);
        let gone = overview(&[("a", true, true, false), ("b", false, false, false)]);
        assert!(lacking(&gone, &map, &Holders::All).is_empty());
    }
}
