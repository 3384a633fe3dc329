//! What a node sees of the others.

use std::collections::BTreeMap;
use std::time::Instant;

use mrol_service::replication::NodeName;
use mrol_service::{NoRoom, Reason};
use uuid::Uuid;

use crate::beat::{Beat, MapHead};
use crate::catalog::Holders;

/// What a node sees of the others after a beat of its own was acknowledged.
#[derive(Debug, Clone, Default)]
pub(super) struct View {
    /// Own beats that were acknowledged, one every two seconds.
    pub(super) beats: u64,
    /// The same, with those in between.
    pub(super) all_beats: u64,
    /// Revision of the bucket with the last of them.
    pub(super) revision: u64,
    /// When the last of them was.
    pub(super) seen: Option<Instant>,
    /// True once it is known of each of the others whether it is gone.
    pub(super) is_settled: bool,
    /// True while this node's beats are not heard: what others do about it is not known.
    pub(super) is_unheard: bool,
    /// The other nodes, those that are gone among them.
    pub(super) others: BTreeMap<NodeName, Seen>,
}

/// Another node.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    /// Its last beat.
    pub(super) beat: Beat,
    /// Revision of the bucket with it.
    pub(super) revision: u64,
    /// False once it is gone, or has ended.
    pub(super) is_live: bool,
}

impl View {
    /// The other nodes that are live and hold a map of which they take changes, with how far they are.
    pub(super) fn holders(&self, map: Uuid) -> impl Iterator<Item = (&NodeName, &MapHead)> {
        let live = self.others.iter().filter(|(_, seen)| seen.is_live);
        live.filter_map(move |(node, seen)| {
            Some((node, seen.beat.maps.get(&map).filter(|it| !it.is_parted)?))
        })
    }

    /// A live node that holds a map and has no room for more of it.
    pub(super) fn without_room(&self, map: Uuid) -> Option<NoRoom> {
        self.holders(map).find_map(|(node, _)| {
            let reason = match self.others[node].beat.no_room.as_deref()? {
                "memory_full" => Reason::MemoryFull,
                _ => Reason::DiskFull,
            };
            Some(NoRoom { node: node.clone(), reason })
        })
    }

    /// The least version of records that the other live nodes read which follow a map, or are about to as its
    /// `holders`: one that has parted from it reads none.
    pub(super) fn reads_least(&self, map: Uuid, holders: &Holders) -> u32 {
        let live = self.others.iter().filter(|(_, seen)| seen.is_live);
        let follow = live.filter(|(node, seen)| match seen.beat.maps.get(&map) {
            Some(head) => !head.is_parted,
            None => holders.contains(node),
        });
        follow.map(|(_, seen)| seen.beat.record_version).min().unwrap_or(u32::MAX)
    }

    /// Version of the records that another node writes.
    pub(super) fn writes(&self, node: &NodeName) -> u32 {
        self.others.get(node).map_or(u32::MAX, |seen| seen.beat.record_version)
    }

    /// The furthest revision of each map at the others that are live, take changes of it and know that they agree.
    pub(super) fn furthest(&self) -> BTreeMap<Uuid, u64> {
        let live = self.others.values().filter(|seen| seen.is_live);
        let heads = live.flat_map(|seen| &seen.beat.maps).filter(|(_, head)| !head.is_parted && head.agrees);
        let mut furthest = BTreeMap::new();
        for (map, head) in heads {
            let revision = furthest.entry(*map).or_insert(head.revision);
            *revision = head.revision.max(*revision);
        }
        furthest
    }

    /// True of another node that is live.
    pub(super) fn is_live(&self, node: &NodeName) -> bool {
        self.others.get(node).is_some_and(|seen| seen.is_live)
    }
}
