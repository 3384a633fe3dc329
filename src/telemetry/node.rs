//! What a node of a cluster says of itself, and of its copies of the maps, at each scrape. A server by itself says
//! nothing of this.

use std::collections::BTreeMap;

use mrol_map::util::Durations;
use mrol_service::{Lead, SharedMap};
use uuid::Uuid;

use super::exposition::{Family, Kind};

/// What a node of a cluster knows of it.
#[derive(Debug, Clone, Default)]
pub struct NodeReading {
    /// True while NATS acknowledges its beats.
    pub is_joined: bool,
    /// True before it has joined, and where its copy of a map is behind those of others, or lacking, for too long.
    pub is_behind: bool,
    /// Nodes that are live, itself among them.
    pub live: usize,
    /// Nodes that are gone.
    pub gone: usize,
    /// The furthest revision of each map at the other nodes that are live.
    pub furthest: BTreeMap<Uuid, u64>,
    /// How often it took a map over.
    pub takeovers: u64,
    /// How long its messages to the logs took until NATS acknowledged them.
    pub acknowledgments: Durations,
}

/// Appends what a node knows of the cluster, and of its copies of the maps that are `shared`.
pub(super) fn write_node(text: &mut String, node: &NodeReading, shared: &[SharedMap]) {
    let what = "1 while NATS acknowledges the node's beats";
    Family::begin(text, "mrol_node_joined", Kind::Gauge, what).sample(&[], u8::from(node.is_joined));
    let what = "1 before the node has joined, and while a copy is behind those of others for too long";
    Family::begin(text, "mrol_node_behind", Kind::Gauge, what).sample(&[], u8::from(node.is_behind));
    let what = "Nodes of the cluster as this one sees them, itself among them, by state: live or gone";
    let mut family = Family::begin(text, "mrol_cluster_nodes", Kind::Gauge, what);
    for (state, count) in [("live", node.live), ("gone", node.gone)] {
        family.sample(&[("state", &state)], count);
    }
    let what = "Times that this node took a map over";
    Family::begin(text, "mrol_node_takeovers_total", Kind::Counter, what).sample(&[], node.takeovers);
    let what = "Seconds until NATS acknowledged a message to the log of a map";
    let mut family = Family::begin(text, "mrol_node_acknowledgment_seconds", Kind::Histogram, what);
    family.histogram(&[], &node.acknowledgments);
    write_copies(text, node, shared);
}

fn write_copies(text: &mut String, node: &NodeReading, shared: &[SharedMap]) {
    type Value<'a> = &'a dyn Fn(&SharedMap) -> Option<u64>;
    let lag = |map: &SharedMap| {
        let furthest = node.furthest.get(&map.version.map_uuid).copied().unwrap_or_default();
        Some(furthest.saturating_sub(map.version.revision))
    };
    let families: [(&'static str, &str, Value<'_>); 4] = [
        ("mrol_map_leads", "1 where this node makes the changes of the map, by map", &|map| {
            Some(u64::from(matches!(map.lead, Lead::Shared { is_here: true, .. })))
        }),
        (
            "mrol_map_epoch",
            "How many times a node was named to lead the map, by map",
            &|map| match map.lead {
                Lead::Shared { epoch, .. } => Some(epoch),
                Lead::Alone | Lead::NotJoined => None,
            },
        ),
        ("mrol_map_lag_revisions", "Revisions that this node is behind the furthest live one, by map", &lag),
        (
            "mrol_map_parted",
            "1 where this node has another history of the map than its log, and takes no changes, by map",
            &|map| Some(u64::from(map.has_diverged)),
        ),
    ];
    for (name, what, value) in families {
        let mut family = Family::begin(text, name, Kind::Gauge, what);
        for (map, value) in shared.iter().filter_map(|map| Some((map, value(map)?))) {
            family.sample(&[("map", &map.name)], value);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use mrol_map::map::MapName;
    use mrol_service::MapVersion;
    use mrol_service::replication::NodeName;

    use super::*;

    fn shared(name: &str, uuid: u128, revision: u64, lead: Lead) -> SharedMap {
        SharedMap {
            name: MapName::new(name).unwrap(),
            version: MapVersion { map_uuid: Uuid::from_u128(uuid), revision, content_hash: None },
            lead,
            failure: None,
            has_diverged: false,
        }
    }

    #[test]
    fn a_node_says_which_maps_it_leads_and_how_far_it_is_behind() {
        let mut acknowledgments = Durations::default();
        acknowledgments.record(Duration::from_millis(2));
        let node = NodeReading {
            is_joined: true,
            live: 2,
            gone: 1,
            furthest: [(Uuid::from_u128(1), 9), (Uuid::from_u128(2), 40)].into(),
            takeovers: 3,
            acknowledgments,
            ..NodeReading::default()
        };
        let led = Lead::Shared {
            leader: NodeName::new("n1").ok(),
            is_here: true,
            has_claimed: true,
            epoch: 4,
            claim: None,
            sequence: 12,
            agrees: true,
        };
        let followed = Lead::Shared {
            leader: NodeName::new("n2").ok(),
            is_here: false,
            has_claimed: false,
            epoch: 2,
            claim: None,
            sequence: 7,
            agrees: true,
        };
        let maps = [
            shared("hall", 1, 12, led),
            SharedMap { has_diverged: true, ..shared("yard", 2, 30, followed) },
            shared("new", 3, 1, Lead::NotJoined),
        ];
        let mut text = String::new();
        write_node(&mut text, &node, &maps);
        for line in [
            "mrol_node_joined 1\n",
            "mrol_node_behind 0\n",
            "mrol_cluster_nodes{state=\"live\"} 2\n",
            "mrol_cluster_nodes{state=\"gone\"} 1\n",
            "mrol_node_takeovers_total 3\n",
            "mrol_node_acknowledgment_seconds_bucket{le=\"0.001\"} 0\n",
            "mrol_node_acknowledgment_seconds_bucket{le=\"0.0025\"} 1\n",
            "mrol_node_acknowledgment_seconds_count 1\n",
            "mrol_map_leads{map=\"hall\"} 1\n",
            "mrol_map_leads{map=\"yard\"} 0\n",
            "mrol_map_leads{map=\"new\"} 0\n",
            "mrol_map_epoch{map=\"hall\"} 4\n",
            "mrol_map_lag_revisions{map=\"hall\"} 0\n",
            "mrol_map_lag_revisions{map=\"yard\"} 10\n",
            "mrol_map_parted{map=\"hall\"} 0\n",
            "mrol_map_parted{map=\"yard\"} 1\n",
        ] {
            assert!(text.contains(line), "{line} is not in\n{text}");
        }
        assert!(!text.contains("mrol_map_epoch{map=\"new\"}"), "it has read no log:\n{text}");
    }
}
