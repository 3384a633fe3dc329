//! What is well and what is wrong, by what NATS tells.

use std::collections::BTreeSet;
use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use super::monitor::{ServerFacts, Syncs};
use mrol::console::bytes;
use mrol_cluster::{Overview, OverviewReader, SeenMap, SeenNode, StreamCopies};

/// Bytes that a node's disk should have left: journals and snapshots need them.
const FREE_MIN: u64 = 1 << 30;
/// Bytes that the largest message of a log needs, with its headers.
const PAYLOAD_MIN: usize = 800 << 10;

/// A thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Finding {
    /// What: `nats`, `stream`, `node`, `versions`, `map`, `contents`.
    what: &'static str,
    verdict: Verdict,
    detail: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Verdict {
    Good,
    Unknown,
    Wrong,
}

impl Finding {
    pub(super) fn good(what: &'static str, detail: impl Display) -> Self {
        Self { what, verdict: Verdict::Good, detail: detail.to_string() }
    }

    pub(super) fn unknown(what: &'static str, detail: impl Display) -> Self {
        Self { verdict: Verdict::Unknown, ..Self::good(what, detail) }
    }

    pub(super) fn wrong(what: &'static str, detail: impl Display) -> Self {
        Self { verdict: Verdict::Wrong, ..Self::good(what, detail) }
    }

    pub(super) fn is_wrong(&self) -> bool {
        self.verdict == Verdict::Wrong
    }
}

impl Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.verdict {
            Verdict::Good => "ok",
            Verdict::Unknown => "unknown",
            Verdict::Wrong => "WRONG",
        };
        write!(f, "{verdict:<8} {:<9} {}", self.what, self.detail)
    }
}

/// Judges what NATS servers say at their monitoring ports.
pub(super) fn monitored<'a>(
    servers: impl Iterator<Item = (&'a String, Result<ServerFacts, String>)>,
) -> Vec<Finding> {
    let judge = |(url, facts): (&String, Result<ServerFacts, String>)| {
        let facts = match facts {
            Ok(facts) => facts,
            Err(why) => return Finding::wrong("nats", why),
        };
        let (name, most) = (&facts.server_name, facts.max_payload);
        match facts.syncs() {
            _ if most < PAYLOAD_MIN => {
                let detail =
                    format!("{name} at {url} takes messages of {most} bytes: set `max_payload: 1MB`");
                Finding::wrong("nats", detail)
            }
            Syncs::Always => Finding::good("nats", format!("{name} at {url} syncs before it acknowledges")),
            Syncs::Never => Finding::wrong("nats", format!("{name} at {url} has no JetStream")),
            Syncs::Every(interval) => Finding::wrong(
                "nats",
                format!(
                    "{name} at {url} syncs every {} s: a loss of power at all servers takes acknowledged changes; set `jetstream \
                     {{ sync_interval: always }}` and start it again",
                    interval.as_secs()
                ),
            ),
        }
    };
    let found: Vec<Finding> = servers.map(judge).collect();
    match found.is_empty() {
        false => found,
        true => vec![Finding::unknown(
            "nats",
            "whether the servers sync before they acknowledge is told at their monitoring ports alone: give each with \
             --monitor http://HOST:8222, or look for `sync_always` in `curl -s http://127.0.0.1:8222/varz` on each host",
        )],
    }
}

/// Judges on how many servers each stream is kept.
pub(super) fn streams(streams: &[StreamCopies], seen: &Overview, wanted: usize) -> Vec<Finding> {
    let named = |stream: &StreamCopies| {
        let map = stream.map.and_then(|uuid| seen.maps.iter().find(|map| map.uuid == uuid));
        map.map_or_else(
            || stream.stream.clone(),
            |map| format!("{} (log of map {})", stream.stream, map.name),
        )
    };
    let problem = |stream: &StreamCopies| {
        let name = named(stream);
        match &stream.servers {
            Err(error) => Some(format!("{name}: {error}")),
            Ok(servers) if servers.replicas < wanted => Some(format!(
                "{name} is kept on {} servers, not {wanted} (cluster.replicas): `nats stream edit {} --replicas {wanted}`",
                servers.replicas, stream.stream
            )),
            Ok(servers) if servers.replicas > 1 && servers.leader.is_none() => {
                Some(format!("{name} has no leader: most of its NATS servers must run and reach each other"))
            }
            Ok(servers) if !servers.behind.is_empty() => {
                Some(format!("{name} is behind, or not reached, on {}", servers.behind.join(", ")))
            }
            Ok(_) => None,
        }
    };
    let problems: Vec<String> = streams.iter().filter_map(problem).collect();
    match problems.is_empty() {
        true => vec![Finding::good(
            "stream",
            format!("{} streams, each on {wanted} or more servers", streams.len()),
        )],
        false => problems.iter().map(|problem| Finding::wrong("stream", problem)).collect(),
    }
}

/// Judges the nodes: live, with room, and able to read what the others write.
pub(super) fn nodes(nodes: &[SeenNode]) -> Vec<Finding> {
    if nodes.is_empty() {
        return vec![Finding::wrong(
            "node",
            "no node has ever beaten: start one with `mrol serve --cluster`",
        )];
    }
    let node = |seen: &SeenNode| {
        let (node, free) = (&seen.node, seen.beat.free_bytes);
        if !seen.is_live {
            let seconds = OverviewReader::SILENT_AFTER.as_secs();
            return Finding::wrong("node", format!("{node} is silent: no beat within {seconds} s"));
        }
        let left = bytes(free as usize);
        match free {
            u64::MAX => {
                Finding::unknown("node", format!("{node} is live; it does not know how full its disk is"))
            }
            free if free < FREE_MIN => Finding::wrong(
                "node",
                format!("{node} has {left} left on its disk, less than {}", bytes(FREE_MIN as usize)),
            ),
            _ => Finding::good("node", format!("{node} is live, {left} left on its disk")),
        }
    };
    nodes.iter().map(node).chain([versions(nodes)]).collect()
}

/// A node may be newer than the others, as long as it writes nothing that they do not read.
fn versions(nodes: &[SeenNode]) -> Finding {
    let live = || nodes.iter().filter(|seen| seen.is_live);
    let oldest = live().map(|seen| seen.beat.record_version).min().unwrap_or_default();
    let writes_more = |seen: &&SeenNode| {
        seen.beat.record_version > oldest && seen.beat.maps.values().any(|head| head.leads)
    };
    if let Some(newer) = live().find(writes_more) {
        let (node, records) = (&newer.node, newer.beat.record_version);
        return Finding::wrong(
            "versions",
            format!(
                "node {node} leads maps with records of version {records}, and another node reads {oldest} at most: bring all \
                 nodes to one version"
            ),
        );
    }
    let versions: BTreeSet<&str> = live().map(|seen| seen.beat.version.as_str()).collect();
    let versions = versions.into_iter().collect::<Vec<_>>().join(", ");
    Finding::good("versions", format!("nodes of version {versions}; all read what is written"))
}

/// Judges who leads each map, and the copies.
pub(super) fn copies_of_maps(seen: &Overview) -> Vec<Finding> {
    let problems: Vec<Finding> = seen.maps.iter().flat_map(|map| problems_of(map, seen)).collect();
    match problems.is_empty() {
        true => vec![Finding::good(
            "map",
            format!("{} maps, each with a leader and whole copies", seen.maps.len()),
        )],
        false => problems,
    }
}

fn problems_of(map: &SeenMap, seen: &Overview) -> Vec<Finding> {
    let name = &map.name;
    let mut problems = Vec::new();
    if map.leader().is_none() {
        problems.push(format!("{name} is led by no live node: it takes no changes"));
    }
    for copy in map.copies.iter().filter(|copy| copy.head.is_parted) {
        let node = &copy.node;
        problems.push(format!(
            "{name}: the copy of node {node} has parted from the log: `mrol cluster keep NODE {name}` makes one copy the map"
        ));
    }
    for copy in map.copies.iter().filter(|copy| copy.is_live && !copy.head.is_parted && !copy.head.agrees) {
        problems.push(format!(
            "{name}: node {node} cannot tell whether its copy, at revision {}, has the history of the log: it can once the log is \
             beyond that; where no node leads, `mrol cluster keep NODE {name}` makes one copy the map",
            copy.head.revision,
            node = copy.node
        ));
    }
    let unknown: Vec<_> =
        map.holders.names().filter(|node| seen.node(node).is_none()).map(ToString::to_string).collect();
    if !unknown.is_empty() {
        problems.push(format!(
            "{name} is to be held by nodes that nobody knows: {}; `mrol cluster copies {name} NODES` names others",
            unknown.join(", ")
        ));
    }
    let holders = seen.nodes.iter().filter(|node| node.is_live && map.holders.contains(&node.node));
    for node in holders.filter(|node| map.copy(&node.node).is_none()) {
        problems
            .push(format!("{name}: node {} has no copy that follows the log; its log says why", node.node));
    }
    problems.iter().map(|problem| Finding::wrong("map", problem)).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use mrol_cluster::{Beat, Holders, MapCopy, MapHead, StreamServers};
    use mrol_map::map::MapName;
    use mrol_service::replication::NodeName;
    use uuid::Uuid;

    use super::*;

    fn node(name: &str, record_version: u32, free_bytes: u64, leads: bool) -> SeenNode {
        let head = MapHead {
            revision: 1,
            epoch: 1,
            claim: None,
            sequence: 1,
            leads,
            is_parted: false,
            agrees: true,
        };
        let beat = Beat {
            version: "0.2.0".to_owned(),
            record_version,
            maps: BTreeMap::from([(Uuid::nil(), head)]),
            free_bytes,
            ..Beat::default()
        };
        SeenNode { node: NodeName::new(name).unwrap(), is_live: true, beat }
    }

    fn wrong(findings: &[Finding]) -> Vec<&str> {
        findings.iter().filter(|finding| finding.is_wrong()).map(|finding| finding.detail.as_str()).collect()
    }

    #[test]
    fn nodes_have_room_and_read_what_the_others_write() {
        let roomy = 5 << 30;
        assert!(wrong(&nodes(&[node("a", 5, roomy, true), node("b", 5, roomy, false)])).is_empty());
        assert!(wrong(&nodes(&[node("a", 5, roomy, true), node("b", 6, roomy, false)])).is_empty());
        let newer = nodes(&[node("a", 5, roomy, false), node("b", 6, roomy, true)]);
        assert!(wrong(&newer)[0].contains("node b leads maps with records of version 6"), "{newer:?}");
        let full = nodes(&[node("a", 5, 1 << 20, true)]);
        assert!(wrong(&full)[0].contains("a has 1.00 MiB left"), "{full:?}");
        let silent = nodes(&[SeenNode { is_live: false, ..node("a", 5, roomy, true) }]);
        assert!(wrong(&silent)[0].contains("a is silent"), "{silent:?}");
        assert!(wrong(&nodes(&[]))[0].contains("no node has ever beaten"));
    }

    #[test]
    fn streams_are_kept_on_as_many_servers_as_is_wanted() {
        let seen = Overview { nodes: Vec::new(), maps: Vec::new() };
        let judged = |replicas, leader: Option<&str>, behind: &[&str]| {
            let (leader, behind) =
                (leader.map(str::to_owned), behind.iter().map(|&name| name.to_owned()).collect());
            let servers = Ok(StreamServers { replicas, leader, behind });
            streams(&[StreamCopies { stream: "s".to_owned(), map: None, servers }], &seen, 3)
        };
        assert!(wrong(&judged(3, Some("n0"), &[])).is_empty());
        assert!(wrong(&judged(1, Some("n0"), &[]))[0].contains("kept on 1 servers, not 3"));
        assert!(wrong(&judged(3, None, &[]))[0].contains("no leader"));
        assert!(wrong(&judged(3, Some("n0"), &["n2"]))[0].contains("not reached, on n2"));
    }

    #[test]
    fn each_holder_has_a_copy_that_follows_the_log_and_one_leads() {
        let of_a_and = |other: &str, head: MapHead| {
            let (mut a, mut b) = (node("a", 5, 5 << 30, true), node("b", 5, 5 << 30, false));
            let copy = |node: &SeenNode, head| MapCopy { node: node.node.clone(), is_live: true, head };
            let copies = vec![copy(&a, a.beat.maps[&Uuid::nil()]), copy(&b, head)];
            for node in [&mut a, &mut b] {
                node.beat.maps.clear();
            }
            let holders = Holders::Only(["a", other].map(|name| NodeName::new(name).unwrap()).into());
            let name = MapName::new("yard").unwrap();
            let map = SeenMap { name, uuid: Uuid::nil(), wished: None, holders, copies };
            Overview { nodes: vec![a, b], maps: vec![map] }
        };
        let follows = node("b", 5, 0, false).beat.maps[&Uuid::nil()];
        let found = |seen: &Overview| wrong(&copies_of_maps(seen)).join("; ");
        assert_eq!(found(&of_a_and("b", follows)), "");
        let unsure = found(&of_a_and("b", MapHead { agrees: false, ..follows }));
        assert!(unsure.contains("node b cannot tell whether its copy, at revision 1,"), "{unsure}");
        let parted = found(&of_a_and("b", MapHead { is_parted: true, agrees: false, ..follows }));
        assert!(parted.contains("of node b has parted") && !parted.contains("cannot tell"), "{parted}");
        let unknown = found(&of_a_and("c", follows));
        assert!(unknown.contains("that nobody knows: c; `mrol cluster copies yard NODES`"), "{unknown}");
        let mut seen = of_a_and("b", follows);
        seen.maps[0].copies.remove(1);
        assert!(found(&seen).contains("node b has no copy"), "{seen:?}");
        seen.maps[0].copies.remove(0);
        assert!(found(&seen).contains("led by no live node"), "{seen:?}");
    }

    #[test]
    fn what_is_not_known_is_said_and_is_not_wrong() {
        let found = monitored(std::iter::empty());
        assert!(wrong(&found).is_empty() && found[0].to_string().starts_with("unknown  nats"), "{found:?}");
        let url = "http://a:8222".to_owned();
        let varz = r#"{"server_name":"n","max_payload":1048576,"jetstream":{"config":{"sync_interval":120000000000}}}"#;
        let found = monitored([(&url, Ok(serde_json::from_str(varz).unwrap()))].into_iter());
        assert!(wrong(&found)[0].contains("n at http://a:8222 syncs every 120 s"), "{found:?}");
    }
}
