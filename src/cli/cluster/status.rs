//! `mrol cluster status`: who is there, and who leads which map.

use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use super::nats::NatsOptions;
use super::table::{cells, table};
use mrol::console::{CliError, Output, bytes};
use mrol_cluster::{MapCopy, Overview, OverviewReader, SeenMap, SeenNode};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol cluster status --nats nats://10.0.0.1:4222
  mrol cluster status --config mrol.toml --json | jq '.maps[] | select(.leader == null)'

Each node beats every two seconds. One that does not for three is shown as silent; one that was told to end says so. A copy that has parted has another history
than the map's log: it takes no changes (`mrol cluster keep --help`).";

/// Show the nodes, the maps, who leads them, and which copies are behind
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Status {
    #[command(flatten)]
    nats: NatsOptions,
}

impl Status {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let seen = self.nats.reader()?.settled().map_err(CliError::failed)?;
        output.print(&Report::of(&seen))
    }
}

#[derive(Debug, Serialize)]
struct Report {
    nodes: Vec<NodeRow>,
    maps: Vec<MapRow>,
}

#[derive(Debug, Serialize)]
struct NodeRow {
    node: String,
    live: bool,
    /// It was told to end, and said so.
    ended: bool,
    version: String,
    record_version: u32,
    http: String,
    grpc: String,
    /// Why maps that the node holds do not grow.
    no_room: Option<String>,
    /// None where the node does not know.
    free_bytes: Option<u64>,
}

#[derive(Debug, Serialize)]
struct MapRow {
    map: String,
    map_uuid: String,
    leader: Option<String>,
    wished: Option<String>,
    /// The nodes that are to hold it; none where all are.
    nodes: Vec<String>,
    epoch: u64,
    revision: u64,
    copies: Vec<CopyRow>,
}

#[derive(Debug, Serialize)]
struct CopyRow {
    node: String,
    live: bool,
    revision: u64,
    /// Revisions behind the furthest copy.
    lag: u64,
    parted: bool,
    /// Its node cannot tell whether it has the history of the log.
    unsure: bool,
}

impl Report {
    fn of(seen: &Overview) -> Self {
        let nodes = seen.nodes.iter().map(NodeRow::of).collect();
        Self { nodes, maps: seen.maps.iter().map(MapRow::of).collect() }
    }

    /// True where no node is live, and one did not say that it ends: it may be up, and NATS take no beats.
    fn is_silent(&self) -> bool {
        let mut nodes = self.nodes.iter();
        nodes.any(|node| !node.ended) && self.nodes.iter().all(|node| !node.live)
    }

    /// What somebody should look at.
    fn warnings(&self) -> Vec<String> {
        let none = "no node has ever beaten: start one with `mrol serve --cluster`".to_owned();
        let none = self.nodes.is_empty().then_some(none);
        let silent = self.nodes.iter().filter(|node| !node.live && !node.ended).map(|node| {
            let seconds = OverviewReader::SILENT_AFTER.as_secs();
            format!("node {} is SILENT: no beat within {seconds} s", node.node)
        });
        let full = self.nodes.iter().filter(|node| node.live).filter_map(|node| {
            let (name, why) = (&node.node, node.no_room.as_ref()?);
            Some(format!(
                "node {name} has NO ROOM ({why}): maps that it holds do not grow; make room there, or take maps off it \
                 (`mrol cluster copies`)"
            ))
        });
        let is_silent = self.is_silent();
        let seconds = OverviewReader::SILENT_AFTER.as_secs();
        let nobody = is_silent.then(|| {
            format!(
                "NO NODE was heard of for {seconds} s: they are down, or NATS takes no beats in time; who leads is not known"
            )
        });
        let maps = self.maps.iter().flat_map(|map| {
            let name = &map.map;
            let unsure_first = map.copies.iter().find(|copy| copy.unsure && copy.live && copy.lag == 0);
            let unled = (!is_silent && map.leader.is_none()).then(|| match unsure_first {
                Some(copy) => format!(
                    "NO NODE LEADS map {name}: it takes no changes, since node {} is the furthest and cannot tell",
                    copy.node
                ),
                None => format!(
                    "NO NODE LEADS map {name}: it takes no changes; a leader that is gone is replaced within ten seconds"
                ),
            });
            let parted = map.copies.iter().filter(|copy| copy.parted).map(move |copy| {
                let node = &copy.node;
                format!(
                    "map {name}: the copy of node {node} has PARTED: it takes no changes; `mrol cluster keep NODE {name}` \
                     makes one copy the map"
                )
            });
            let unsure = map.copies.iter().filter(|copy| copy.unsure).map(move |copy| {
                let node = &copy.node;
                format!(
                    "map {name}: node {node} CANNOT TELL whether its copy, at revision {}, has the history of the map's log. It \
                     can once the log is beyond that. Where no node leads, `mrol cluster keep NODE {name}` makes one copy \
                     the map",
                    copy.revision
                )
            });
            unled.into_iter().chain(parted).chain(unsure)
        });
        none.into_iter().chain(nobody).chain(silent).chain(full).chain(maps).collect()
    }
}

impl NodeRow {
    fn of(SeenNode { node, is_live, beat }: &SeenNode) -> Self {
        Self {
            node: node.to_string(),
            live: *is_live,
            ended: beat.has_ended,
            no_room: beat.no_room.clone(),
            version: beat.version.clone(),
            record_version: beat.record_version,
            http: beat.http.clone(),
            grpc: beat.grpc.clone(),
            free_bytes: (beat.free_bytes < u64::MAX).then_some(beat.free_bytes),
        }
    }

    fn cells(&self) -> Vec<String> {
        let state = match (self.live, self.ended) {
            (true, _) => "live",
            (false, true) => "ended",
            (false, false) => "SILENT",
        };
        let free = self.free_bytes.map_or("?".to_owned(), |free| bytes(free as usize));
        cells([&self.node, state, &self.version, &free, &self.grpc, &self.http])
    }
}

impl MapRow {
    fn of(map: &SeenMap) -> Self {
        let copy = |copy: &MapCopy| CopyRow {
            node: copy.node.to_string(),
            live: copy.is_live,
            revision: copy.head.revision,
            lag: map.lag(copy),
            parted: copy.head.is_parted,
            unsure: !copy.head.agrees && !copy.head.is_parted,
        };
        Self {
            map: map.name.to_string(),
            map_uuid: map.uuid.to_string(),
            leader: map.leader().map(|copy| copy.node.to_string()),
            wished: map.wished.as_ref().map(ToString::to_string),
            nodes: map.holders.names().map(ToString::to_string).collect(),
            epoch: map.copies.iter().map(|copy| copy.head.epoch).max().unwrap_or_default(),
            revision: map.furthest(),
            copies: map.copies.iter().map(copy).collect(),
        }
    }

    fn cells(&self) -> Vec<String> {
        let copies: Vec<String> = self.copies.iter().map(ToString::to_string).collect();
        cells([
            &self.map,
            self.leader.as_deref().unwrap_or("NONE"),
            self.wished.as_deref().unwrap_or("any"),
            &if self.nodes.is_empty() { "all".to_owned() } else { self.nodes.join(",") },
            &self.epoch.to_string(),
            &self.revision.to_string(),
            &if copies.is_empty() { "no copies".to_owned() } else { copies.join(", ") },
            &self.map_uuid,
        ])
    }
}

impl Display for CopyRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.node, self.revision)?;
        if self.lag > 0 && !self.parted {
            write!(f, " ({} behind)", self.lag)?;
        }
        f.write_str(if self.parted { " PARTED" } else { "" })?;
        f.write_str(if self.unsure { " UNSURE" } else { "" })?;
        f.write_str(if self.live { "" } else { " silent" })
    }
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head = cells(["NODE", "STATE", "VERSION", "FREE", "GRPC", "HTTP"]);
        let nodes: Vec<_> = [head].into_iter().chain(self.nodes.iter().map(NodeRow::cells)).collect();
        writeln!(f, "{}\n", table(&nodes))?;
        let head = cells(["MAP", "LEADER", "WISHED", "HELD BY", "EPOCH", "REVISION", "COPIES", "UUID"]);
        let maps: Vec<_> = [head].into_iter().chain(self.maps.iter().map(MapRow::cells)).collect();
        write!(f, "{}", table(&maps))?;
        let warnings = self.warnings();
        if !warnings.is_empty() {
            write!(f, "\n\n{}", warnings.join("\n"))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn copy(node: &str, revision: u64, lag: u64) -> CopyRow {
        CopyRow { node: node.into(), live: true, revision, lag, parted: false, unsure: false }
    }

    #[test]
    fn what_is_wrong_is_loud() {
        let node = |node: &str, live| NodeRow {
            node: node.into(),
            live,
            ended: node == "d",
            no_room: (node == "a").then(|| "disk_full".to_owned()),
            version: "0.2.0".into(),
            record_version: 5,
            http: "http://a:7333".into(),
            grpc: "http://a:7334".into(),
            free_bytes: Some(3 << 30),
        };
        let map = |map: &str, leader: Option<&str>, copies| MapRow {
            map: map.into(),
            map_uuid: "u".into(),
            leader: leader.map(str::to_owned),
            wished: None,
            nodes: Vec::new(),
            epoch: 3,
            revision: 20,
            copies,
        };
        let parted = CopyRow { parted: true, live: false, ..copy("c", 25, 0) };
        let report = Report {
            nodes: vec![node("a", true), node("b", false), node("d", false)],
            maps: vec![
                map("hall", Some("a"), vec![copy("a", 20, 0), copy("b", 18, 2), parted]),
                map("yard", None, vec![CopyRow { unsure: true, ..copy("a", 7, 0) }]),
            ],
        };
        let text = report.to_string();
        for part in [
            "a     live    0.2.0    3.00 GiB",
            "b     SILENT",
            "d     ended",
            "hall  a       any     all      3      20        a 20, b 18 (2 behind), c 25 PARTED silent  u",
            "yard  NONE    any     all      3      20        a 7 UNSURE",
            "node b is SILENT: no beat within 3 s",
            "node a has NO ROOM (disk_full)",
            "NO NODE LEADS map yard: it takes no changes, since node a is the furthest and cannot tell",
            "map hall: the copy of node c has PARTED",
            "map yard: node a CANNOT TELL",
        ] {
            assert!(text.contains(part), "{part} is not in\n{text}");
        }
        let nobody = Report { nodes: Vec::new(), maps: Vec::new() }.to_string();
        assert!(
            nobody.contains("no node has ever beaten: start one with `mrol serve --cluster`"),
            "{nobody}"
        );
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(
            (&json["maps"][0]["copies"][1]["lag"], &json["maps"][1]["leader"]),
            (&2.into(), &().into())
        );
        let of_nodes = |nodes| Report { nodes, maps: vec![map("yard", None, vec![copy("b", 7, 0)])] };
        let silent = of_nodes(vec![node("b", false), node("d", false)]).warnings().join("; ");
        assert!(silent.contains("who leads is not known") && !silent.contains("NO NODE LEADS"), "{silent}");
        let ended = of_nodes(vec![node("d", false)]).warnings().join("; ");
        assert!(ended.contains("NO NODE LEADS map yard") && !ended.contains("is not known"), "{ended}");
    }
}
