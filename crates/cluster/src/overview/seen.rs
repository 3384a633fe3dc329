//! Nodes and maps of a cluster, as they are seen at one moment.

use mrol_map::map::MapName;
use mrol_service::replication::NodeName;
use uuid::Uuid;

use crate::beat::{Beat, MapHead};
use crate::catalog::{Holders, Listing, MapEntry};

/// Nodes and maps of a cluster, as they are seen at one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Overview {
    /// The nodes, by name, those that are gone among them.
    pub nodes: Vec<SeenNode>,
    /// The maps of the cluster's list, by name.
    pub maps: Vec<SeenMap>,
}

/// A node, as its last beat has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeenNode {
    /// Its name.
    pub node: NodeName,
    /// True where it has beaten since the reader looked first.
    pub is_live: bool,
    /// Its last beat.
    pub beat: Beat,
}

/// A map of the list, with the copies that the nodes have of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeenMap {
    /// Its name.
    pub name: MapName,
    /// Its uuid.
    pub uuid: Uuid,
    /// The node that is to lead it whenever it can; none where any will do.
    pub wished: Option<NodeName>,
    /// The nodes that are to hold it.
    pub holders: Holders,
    /// The copies, by node: also those of nodes that are to hold it no more, until others have what they have.
    pub copies: Vec<MapCopy>,
}

/// A node's copy of a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapCopy {
    /// Whose.
    pub node: NodeName,
    /// True where that node has beaten since the reader looked first.
    pub is_live: bool,
    /// How far it is.
    pub head: MapHead,
}

impl Overview {
    /// Of a list and of beats, each with whether its node is live.
    pub(super) fn of(listing: &Listing, mut nodes: Vec<SeenNode>) -> Self {
        nodes.sort_unstable_by(|a, b| a.node.cmp(&b.node));
        let seen = |(name, entry): (MapName, &MapEntry)| {
            let copy = |seen: &SeenNode| {
                let head = *seen.beat.maps.get(&entry.uuid)?;
                Some(MapCopy { node: seen.node.clone(), is_live: seen.is_live, head })
            };
            let copies = nodes.iter().filter_map(copy).collect();
            SeenMap { name, uuid: entry.uuid, wished: entry.leader(), holders: entry.holders(), copies }
        };
        Self { maps: listing.maps().map(seen).collect(), nodes }
    }

    /// The node of that name.
    pub fn node(&self, name: &NodeName) -> Option<&SeenNode> {
        self.nodes.iter().find(|seen| seen.node == *name)
    }

    /// The map of that name.
    pub fn map(&self, name: &MapName) -> Option<&SeenMap> {
        self.maps.iter().find(|seen| seen.name == *name)
    }
}

impl SeenMap {
    /// The copy of the live node that leads: of the latest epoch, where one has not heard yet of its successor.
    pub fn leader(&self) -> Option<&MapCopy> {
        let leads = |copy: &&MapCopy| copy.is_live && copy.head.leads && !copy.head.is_parted;
        let newest = self.copies.iter().map(|copy| copy.head.epoch).max().unwrap_or_default();
        self.copies.iter().filter(leads).find(|copy| copy.head.epoch == newest)
    }

    /// The greatest revision of a copy that has not parted from the log.
    pub fn furthest(&self) -> u64 {
        let whole = self.copies.iter().filter(|copy| !copy.head.is_parted);
        whole.map(|copy| copy.head.revision).max().unwrap_or_default()
    }

    /// How many revisions a copy is behind the furthest.
    pub fn lag(&self, copy: &MapCopy) -> u64 {
        self.furthest().saturating_sub(copy.head.revision)
    }

    /// The copy of that node.
    pub fn copy(&self, node: &NodeName) -> Option<&MapCopy> {
        self.copies.iter().find(|copy| copy.node == *node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn copy(node: &str, revision: u64, epoch: u64, leads: bool, is_live: bool) -> MapCopy {
        let head = MapHead {
            revision,
            epoch,
            claim: None,
            sequence: revision,
            leads,
            is_parted: false,
            agrees: true,
        };
        MapCopy { node: NodeName::new(node).unwrap(), is_live, head }
    }

    fn map(copies: Vec<MapCopy>) -> SeenMap {
        let (name, uuid) = (MapName::new("hall").unwrap(), Uuid::nil());
        SeenMap { name, uuid, wished: None, holders: Holders::All, copies }
    }

    fn leader(copies: Vec<MapCopy>) -> Option<String> {
        map(copies).leader().map(|copy| copy.node.to_string())
    }

    #[test]
    fn a_map_is_led_by_the_live_node_of_the_latest_epoch() {
        assert_eq!(leader(Vec::new()), None);
        assert_eq!(leader(vec![copy("a", 5, 1, true, true)]).as_deref(), Some("a"));
        assert_eq!(leader(vec![copy("a", 5, 1, true, false), copy("b", 5, 1, false, true)]), None);
        // Its successor has claimed, and it has not heard.
        let both = vec![copy("a", 5, 1, true, true), copy("b", 5, 2, true, true)];
        assert_eq!(leader(both).as_deref(), Some("b"));
        let claimed = vec![copy("a", 5, 1, true, true), copy("b", 5, 2, false, true)];
        assert_eq!(leader(claimed), None, "another leads by the log, and has not said so yet");
        let mut parted = copy("a", 5, 1, true, true);
        parted.head.is_parted = true;
        assert_eq!(leader(vec![parted]), None);
    }

    #[test]
    fn copies_are_behind_the_furthest_that_has_not_parted() {
        let mut parted = copy("c", 9, 1, false, true);
        parted.head.is_parted = true;
        let map = map(vec![copy("a", 7, 1, true, true), copy("b", 4, 1, false, true), parted]);
        assert_eq!(map.furthest(), 7);
        let lags: Vec<u64> = map.copies.iter().map(|copy| map.lag(copy)).collect();
        assert_eq!(lags, [0, 3, 0]);
    }
}
