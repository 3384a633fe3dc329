//! The maps of a cluster, and those that were deleted.

use std::collections::{BTreeMap, BTreeSet};

use mrol_map::map::MapName;
use mrol_service::replication::NodeName;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use uuid::Uuid;

use super::error::CatalogError;
use super::holders::Holders;
use super::placement::Placement;

/// Maps that are listed, at most: the list is one message of NATS.
const MAPS_MAX: usize = 4_000;
/// Maps that were deleted and are not forgotten, at most.
const DELETED_MAX: usize = 8_000;

/// The maps of a cluster, by name, and those that were deleted. What a later version adds is kept, and means nothing to
/// this one.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Listing {
    maps: BTreeMap<String, MapEntry>,
    /// Maps that were deleted, as long as a node may still have a copy. That a map is not listed deletes nothing
    /// anywhere: an older list may have been put back.
    #[serde(default)]
    deleted: BTreeSet<Uuid>,
    #[serde(flatten)]
    later: Map<String, Value>,
}

/// What is listed of a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapEntry {
    /// Its uuid.
    pub uuid: Uuid,
    /// The node that is to lead it whenever it can; none where any will do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    leader: Option<String>,
    /// The nodes that hold it; none where all do.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    nodes: Vec<String>,
    #[serde(flatten)]
    later: Map<String, Value>,
}

impl MapEntry {
    /// Of a map that any of its holders may lead.
    pub fn new(uuid: Uuid, holders: &Holders) -> Self {
        Self { uuid, leader: None, nodes: texts(holders), later: Map::new() }
    }

    /// The node that is to lead it whenever it can.
    pub fn leader(&self) -> Option<NodeName> {
        self.leader.as_deref().and_then(|name| NodeName::new(name).ok())
    }

    /// The nodes that hold it. What is no name is left out.
    pub fn holders(&self) -> Holders {
        match self.nodes.is_empty() {
            true => Holders::All,
            false => Holders::Only(self.nodes.iter().filter_map(|name| NodeName::new(name).ok()).collect()),
        }
    }

    /// Where it is to be.
    pub fn placement(&self) -> Placement {
        Placement { holders: self.holders(), leader: self.leader() }
    }
}

/// The names of the nodes, as they are listed: none where all nodes hold a map.
fn texts(holders: &Holders) -> Vec<String> {
    holders.names().map(ToString::to_string).collect()
}

impl Listing {
    /// The maps by name. What is no name is left out.
    pub fn maps(&self) -> impl Iterator<Item = (MapName, &MapEntry)> {
        self.maps.iter().filter_map(|(name, entry)| Some((MapName::new(name).ok()?, entry)))
    }

    /// The map of that name.
    pub fn map(&self, name: &MapName) -> Option<&MapEntry> {
        self.maps.get(name.as_str())
    }

    /// Which map has the name where this one is to be listed; none where the name is free and it may be listed.
    ///
    /// # Errors
    /// It is listed under another name, was deleted, or the list is full.
    pub(crate) fn check_place(&self, name: &MapName, uuid: Uuid) -> Result<Option<Uuid>, CatalogError> {
        if let Some(there) = self.map(name) {
            return Ok(Some(there.uuid));
        }
        if let Some((other, _)) = self.maps().find(|(_, entry)| entry.uuid == uuid) {
            return Err(CatalogError::OtherName(other));
        }
        if self.is_deleted(uuid) {
            return Err(CatalogError::Deleted(uuid));
        }
        if self.maps.len() >= MAPS_MAX || self.deleted.len() >= DELETED_MAX {
            return Err(CatalogError::Full);
        }
        Ok(None)
    }

    /// True of a map that was deleted: no node keeps a copy.
    pub fn is_deleted(&self, uuid: Uuid) -> bool {
        self.deleted.contains(&uuid)
    }

    /// Those that were deleted.
    pub fn deleted(&self) -> impl Iterator<Item = Uuid> {
        self.deleted.iter().copied()
    }

    /// The nodes that hold the map of that uuid; all, where it is not listed.
    pub fn holders_of(&self, uuid: Uuid) -> Holders {
        self.maps.values().find(|entry| entry.uuid == uuid).map(MapEntry::holders).unwrap_or_default()
    }

    /// The maps that are listed and that a node does not hold.
    pub fn not_held_by(&self, node: &NodeName) -> BTreeSet<Uuid> {
        let entries = self.maps.values().filter(|entry| !entry.holders().contains(node));
        entries.map(|entry| entry.uuid).collect()
    }

    /// Enters a map under a name that is free.
    pub(super) fn enter(&mut self, name: &MapName, uuid: Uuid, holders: &Holders) {
        self.maps.insert(name.as_str().to_owned(), MapEntry::new(uuid, holders));
    }

    /// Says which nodes are to hold a map; false where there is no such map. That one of the others is to lead it is
    /// forgotten.
    pub(super) fn set_holders(&mut self, name: &MapName, holders: &Holders) -> bool {
        let Some(entry) = self.maps.get_mut(name.as_str()) else { return false };
        entry.nodes = texts(holders);
        if entry.leader().is_some_and(|leader| !holders.contains(&leader)) {
            entry.leader = None;
        }
        true
    }

    /// Takes a map out for good, and says its uuid.
    pub(super) fn delete(&mut self, name: &MapName) -> Option<Uuid> {
        let entry = self.maps.remove(name.as_str())?;
        self.deleted.insert(entry.uuid);
        Some(entry.uuid)
    }

    /// Says which node is to lead a map; false where there is no such map.
    pub(super) fn set_leader(&mut self, name: &MapName, leader: Option<&NodeName>) -> bool {
        let entry = self.maps.get_mut(name.as_str());
        entry.map(|entry| entry.leader = leader.map(ToString::to_string)).is_some()
    }

    /// Forgets maps that were deleted.
    pub(super) fn forget(&mut self, deleted: &BTreeSet<Uuid>) {
        self.deleted.retain(|uuid| !deleted.contains(uuid));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(text: &str) -> MapName {
        MapName::new(text).unwrap()
    }

    #[test]
    fn a_map_that_is_deleted_stays_so() {
        let (mut listing, [one, two]) = (Listing::default(), [1, 2].map(Uuid::from_u128));
        listing.enter(&name("hall"), one, &Holders::All);
        assert_eq!(listing.delete(&name("hall")), Some(one));
        assert_eq!(listing.delete(&name("hall")), None);
        listing.enter(&name("hall"), two, &Holders::All);
        assert!(listing.is_deleted(one) && !listing.is_deleted(two));
        listing.forget(&BTreeSet::from([one]));
        assert!(!listing.is_deleted(one));
    }

    #[test]
    fn a_map_is_listed_once_and_not_again_once_it_was_deleted() {
        let (mut listing, [one, two]) = (Listing::default(), [1, 2].map(Uuid::from_u128));
        assert_eq!(listing.check_place(&name("hall"), one), Ok(None));
        listing.enter(&name("hall"), one, &Holders::All);
        assert_eq!(listing.check_place(&name("hall"), one), Ok(Some(one)));
        assert_eq!(listing.check_place(&name("hall"), two), Ok(Some(one)));
        assert_eq!(listing.check_place(&name("yard"), one), Err(CatalogError::OtherName(name("hall"))));
        listing.delete(&name("hall"));
        assert_eq!(listing.check_place(&name("hall"), one), Err(CatalogError::Deleted(one)));
        assert_eq!(listing.check_place(&name("hall"), two), Ok(None));
    }

    #[test]
    fn a_map_is_held_by_all_nodes_or_by_those_that_are_named() {
        let node = |name: &str| NodeName::new(name).unwrap();
        let (mut listing, [one, two]) = (Listing::default(), [1, 2].map(Uuid::from_u128));
        let both = Holders::Only([node("b"), node("a")].into());
        listing.enter(&name("hall"), one, &both);
        listing.enter(&name("yard"), two, &Holders::All);
        let text = serde_json::to_string(&listing).unwrap();
        assert!(text.contains(r#""nodes":["a","b"]"#) && text.matches("nodes").count() == 1, "{text}");
        let mut listing: Listing = serde_json::from_str(&text).unwrap();
        assert_eq!((listing.holders_of(one), listing.holders_of(two)), (both, Holders::All));
        assert_eq!(listing.not_held_by(&node("c")), BTreeSet::from([one]));
        assert!(listing.not_held_by(&node("b")).is_empty());
        // A node that holds it no more is not to lead it either.
        listing.set_leader(&name("hall"), Some(&node("a")));
        assert!(listing.set_holders(&name("hall"), &Holders::Only([node("a"), node("c")].into())));
        assert_eq!(listing.map(&name("hall")).unwrap().leader(), Some(node("a")));
        assert!(listing.set_holders(&name("hall"), &Holders::Only([node("b")].into())));
        assert_eq!(listing.map(&name("hall")).unwrap().leader(), None);
        assert!(listing.set_holders(&name("hall"), &Holders::All));
        assert_eq!(listing.map(&name("hall")).unwrap().holders(), Holders::All);
        assert!(!listing.set_holders(&name("none"), &Holders::All));
    }

    #[test]
    fn what_a_later_version_adds_is_kept() {
        let text = r#"{"maps":{"hall":{"uuid":"00000000-0000-0000-0000-000000000001","copies":["a"]}},"mood":"good"}"#;
        let mut listing: Listing = serde_json::from_str(text).unwrap();
        assert!(listing.set_leader(&name("hall"), Some(&NodeName::new("a").unwrap())));
        assert!(!listing.set_leader(&name("yard"), None));
        let written = serde_json::to_string(&listing).unwrap();
        assert!(written.contains(r#""copies":["a"]"#) && written.contains(r#""mood":"good""#), "{written}");
        let read: Listing = serde_json::from_str(&written).unwrap();
        assert_eq!(read.map(&name("hall")).unwrap().leader().unwrap().as_str(), "a");
        assert_eq!(read, listing);
    }
}
