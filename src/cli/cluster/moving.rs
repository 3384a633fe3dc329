//! `mrol cluster move`: says which node is to lead a map, and waits until it does.

use std::fmt;
use std::fmt::Display;
use std::thread;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::known::{known_map, known_node};
use super::nats::NatsOptions;
use mrol::console::parse;
use mrol::console::{CliError, Output};
use mrol_cluster::{Overview, OverviewReader};
use mrol_map::map::MapName;
use mrol_service::replication::NodeName;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol cluster move office n2 --nats nats://10.0.0.1:4222    node n2 is to lead map office, now and whenever it can
  mrol cluster move office --any --config mrol.toml          any node may lead it: the wish is taken back

The node that leads hands the map over once the other has followed: no change is lost, and callers notice a pause of some
milliseconds. The wish stays in the list of maps: a node that was away gets the map back once it has caught up.";

/// How often it is looked who leads.
const LOOKED_EVERY: Duration = Duration::from_millis(250);

/// Say which node is to lead a map, and wait until it does
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct MoveLead {
    /// The map
    #[arg(value_name = "MAP", value_parser = parse::map_name)]
    map: MapName,
    /// The node that is to lead it whenever it can
    #[arg(value_name = "NODE", value_parser = parse::node_name, required_unless_present = "any", conflicts_with = "any")]
    node: Option<NodeName>,
    /// Any node may lead it
    #[arg(long)]
    any: bool,
    /// How long to wait until the node leads: 20s, 2m
    #[arg(long, value_name = "TIME", default_value = "20s", value_parser = parse::duration)]
    wait: Duration,
    #[command(flatten)]
    nats: NatsOptions,
}

impl MoveLead {
    pub(super) fn run(self, output: Output) -> Result<(), CliError> {
        let reader = self.nats.reader()?;
        let seen = reader.look().map_err(CliError::failed)?;
        check_known(&seen, &self.map, self.node.as_ref())?;
        let is_there = reader.store().catalog.set_leader(&self.map, self.node.as_ref());
        if !is_there.map_err(CliError::failed)? {
            return Err(CliError::failed(format!("map {} was deleted meanwhile", self.map)));
        }
        let Some(node) = self.node else {
            let map = self.map.to_string();
            return output.print(&Moved { map, wished: None, leader: None, epoch: None });
        };
        let output = output.with_spinner();
        let led = wait(&reader, &self.map, &node, self.wait, &output);
        output.clear_bar();
        let (map, node) = (self.map.to_string(), node.to_string());
        output.print(&Moved { map, wished: Some(node.clone()), leader: Some(node), epoch: Some(led?) })
    }
}

/// Refuses a map that is not listed, and a node that nobody has heard of or that is not to hold the map.
fn check_known(seen: &Overview, map: &MapName, node: Option<&NodeName>) -> Result<(), CliError> {
    let of_map = known_map(seen, map)?;
    let Some(node) = node else { return Ok(()) };
    known_node(seen, node)?;
    if !of_map.holders.contains(node) {
        return Err(CliError::failed(format!(
            "node {node} does not hold map {map}, which nodes {} hold: `mrol cluster copies {map} ...` changes that",
            of_map.holders
        )));
    }
    Ok(())
}

/// Waits until the beats say that the node leads, and says in which epoch.
fn wait(
    reader: &OverviewReader,
    map: &MapName,
    node: &NodeName,
    patience: Duration,
    output: &Output,
) -> Result<u64, CliError> {
    let begun = Instant::now();
    loop {
        let seen = reader.look().map_err(CliError::failed)?;
        let leader = seen.map(map).and_then(|map| map.leader());
        if let Some(led) = leader.filter(|led| led.node == *node) {
            return Ok(led.head.epoch);
        }
        let obstacle = obstacle(&seen, map, node);
        if begun.elapsed() >= patience {
            return Err(CliError::failed(format!(
                "node {node} does not lead map {map} after {} s: {obstacle}. The wish stays, and is followed once that is \
                 over; `mrol cluster move {map} --any` takes it back",
                patience.as_secs()
            )));
        }
        output.tell(obstacle);
        thread::sleep(LOOKED_EVERY);
    }
}

/// What keeps a node from leading a map, as far as the beats tell.
fn obstacle(seen: &Overview, map: &MapName, node: &NodeName) -> String {
    let Some(of_map) = seen.map(map) else { return format!("map {map} was deleted") };
    match seen.node(node) {
        None => return format!("node {node} has left the cluster"),
        Some(seen) if !seen.is_live => return format!("node {node} is silent: it does not beat"),
        Some(_) => {}
    }
    let Some(copy) = of_map.copy(node) else { return format!("node {node} has no copy of map {map} yet") };
    if copy.head.is_parted {
        return format!(
            "the copy of node {node} has parted from the log of map {map}: `mrol cluster keep` makes one copy the map"
        );
    }
    match (of_map.lag(copy), of_map.leader()) {
        (lag, _) if lag > 0 => {
            format!("node {node} is {lag} revisions behind, at revision {}", copy.head.revision)
        }
        (_, None) => format!("no live node leads map {map}, to hand it over"),
        (_, Some(leader)) => format!("node {} has not handed it over yet", leader.node),
    }
}

#[derive(Serialize)]
struct Moved {
    map: String,
    wished: Option<String>,
    leader: Option<String>,
    epoch: Option<u64>,
}

impl Display for Moved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.leader, self.epoch) {
            (Some(leader), Some(epoch)) => {
                write!(f, "map {}: node {leader} leads, in epoch {epoch}", self.map)
            }
            _ => write!(f, "map {}: any node may lead it", self.map),
        }
    }
}

#[cfg(test)]
mod tests {
    use mrol_cluster::{Beat, Holders, MapCopy, MapHead, SeenMap, SeenNode};
    use uuid::Uuid;

    use super::*;

    /// Nodes with a copy of map `hall`: name, whether it is live, revision, whether it leads, whether it has parted.
    fn overview(nodes: &[(&str, bool, Option<u64>, bool, bool)]) -> Overview {
        let beat = Beat::default();
        let node = |name: &str| NodeName::new(name).unwrap();
        let copy = |&(name, is_live, revision, leads, is_parted): &(&str, bool, Option<u64>, bool, bool)| {
            let head = MapHead {
                revision: revision?,
                epoch: 1,
                claim: None,
                sequence: 0,
                leads,
                is_parted,
                agrees: true,
            };
            Some(MapCopy { node: node(name), is_live, head })
        };
        let copies = nodes.iter().filter_map(copy).collect();
        let seen = |&(name, is_live, ..): &(&str, bool, Option<u64>, bool, bool)| SeenNode {
            node: node(name),
            is_live,
            beat: beat.clone(),
        };
        let (name, uuid, holders) = (MapName::new("hall").unwrap(), Uuid::nil(), Holders::All);
        let map = SeenMap { name, uuid, wished: None, holders, copies };
        Overview { nodes: nodes.iter().map(seen).collect(), maps: vec![map] }
    }

    #[test]
    fn what_keeps_a_node_from_leading_is_said() {
        let (hall, b) = (MapName::new("hall").unwrap(), NodeName::new("b").unwrap());
        let a = ("a", true, Some(9), true, false);
        for (other, said) in [
            (("b", false, Some(9), false, false), "silent"),
            (("b", true, None, false, false), "has no copy"),
            (("b", true, Some(9), false, true), "parted"),
            (("b", true, Some(7), false, false), "2 revisions behind, at revision 7"),
            (("b", true, Some(9), false, false), "node a has not handed it over yet"),
        ] {
            let why = obstacle(&overview(&[a, other]), &hall, &b);
            assert!(why.contains(said), "{why}");
        }
        let unled = overview(&[("a", false, Some(9), true, false), ("b", true, Some(9), false, false)]);
        assert!(obstacle(&unled, &hall, &b).contains("no live node leads"));
        let refused = |map: &str, node: &str| {
            let (map, node) = (MapName::new(map).unwrap(), NodeName::new(node).unwrap());
            check_known(&overview(&[a]), &map, Some(&node)).map_err(|error| error.to_string())
        };
        assert_eq!(refused("hall", "a"), Ok(()));
        assert_eq!(refused("yard", "a").unwrap_err(), "map yard is none of the cluster's, which are: hall");
        assert_eq!(refused("hall", "z").unwrap_err(), "node z is none of the cluster's, which are: a");
        let mut held = overview(&[a, ("b", true, None, false, false)]);
        held.maps[0].holders = Holders::Only([NodeName::new("a").unwrap()].into());
        let why = check_known(&held, &hall, Some(&b)).unwrap_err().to_string();
        assert!(why.starts_with("node b does not hold map hall, which nodes a hold"), "{why}");
    }
}
