//! The viewpoints of a map.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Viewpoint;
use super::reach::{ReachIndex, Slot};

/// The viewpoints of a map, by the revisions of the scans that left them, with an index of who looked where.
#[derive(Clone, Default)]
pub struct ViewpointSet {
    slots: Vec<Option<Arc<Viewpoint>>>,
    by_revision: BTreeMap<u64, Slot>,
    unused: Vec<Slot>,
    index: ReachIndex,
    bytes: usize,
    stored_bytes: usize,
}

impl ViewpointSet {
    /// Keeps the viewpoint of the scan that made `revision`.
    pub fn insert(&mut self, revision: u64, viewpoint: Arc<Viewpoint>) {
        self.remove(revision);
        let slot = self.unused.pop().unwrap_or_else(|| {
            self.slots.push(None);
            (self.slots.len() - 1) as Slot
        });
        self.index.insert(slot, viewpoint.reach());
        self.by_revision.insert(revision, slot);
        self.bytes += viewpoint.memory_bytes();
        self.stored_bytes += viewpoint.image().stored_bytes();
        self.slots[slot as usize] = Some(viewpoint);
    }

    /// Forgets the viewpoint of the scan that made `revision`; returns it, where there was one.
    pub fn remove(&mut self, revision: u64) -> Option<Arc<Viewpoint>> {
        let slot = self.by_revision.remove(&revision)?;
        let viewpoint = self.slots[slot as usize].take()?;
        self.index.remove(slot, viewpoint.reach());
        self.unused.push(slot);
        self.bytes -= viewpoint.memory_bytes();
        self.stored_bytes -= viewpoint.image().stored_bytes();
        Some(viewpoint)
    }

    /// The viewpoints, with the revisions of the scans that left them, in that order.
    pub fn iter(&self) -> impl Iterator<Item = (u64, &Arc<Viewpoint>)> {
        self.by_revision.iter().filter_map(|(&revision, &slot)| Some((revision, self.at(slot)?)))
    }

    /// The viewpoint of the scan that made `revision`.
    pub fn get(&self, revision: u64) -> Option<&Arc<Viewpoint>> {
        self.at(*self.by_revision.get(&revision)?)
    }

    /// Number of viewpoints.
    pub fn len(&self) -> usize {
        self.by_revision.len()
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.by_revision.is_empty()
    }

    /// Bytes of memory, the index with them.
    pub fn memory_bytes(&self) -> usize {
        self.bytes
    }

    /// Bytes of the images where they are stored.
    pub fn stored_bytes(&self) -> usize {
        self.stored_bytes
    }

    /// True where one of the viewpoints saw beyond `point_m` (map frame, meters).
    pub fn sees_through(&self, point_m: [f64; 3]) -> bool {
        self.observer(point_m).is_some()
    }

    /// The parts of space that a viewpoint may have seen a point of, each once: boxes of the map frame, as the smallest and the largest
    /// coordinates, meters. Boxes of viewpoints that reach further are larger, and may hold others.
    pub fn boxes_m(&self) -> impl Iterator<Item = [[f64; 3]; 2]> {
        self.index.boxes_m()
    }

    /// The viewpoints that may have seen beyond a point between two corners (map frame, meters), first those that saw most there.
    ///
    /// Takes longer the further apart the corners are, against how far viewpoints see.
    pub fn within(&self, low_m: [f64; 3], high_m: [f64; 3]) -> impl Iterator<Item = &Viewpoint> {
        self.index.within(low_m, high_m).into_iter().filter_map(|slot| self.at(slot).map(Arc::as_ref))
    }

    /// Looks at many points that lie near each other, one after the other.
    pub fn gaze(&self) -> Gaze<'_> {
        Gaze { set: self, last: None }
    }

    fn observer(&self, point_m: [f64; 3]) -> Option<&Viewpoint> {
        let mut candidates = self.index.around(point_m).filter_map(|slot| self.at(slot));
        candidates.find(|viewpoint| viewpoint.sees_through(point_m)).map(Arc::as_ref)
    }

    fn at(&self, slot: Slot) -> Option<&Arc<Viewpoint>> {
        self.slots.get(slot as usize)?.as_ref()
    }
}

impl PartialEq for ViewpointSet {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl std::fmt::Debug for ViewpointSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_map().entries(self.iter()).finish()
    }
}

impl Extend<(u64, Arc<Viewpoint>)> for ViewpointSet {
    fn extend<I: IntoIterator<Item = (u64, Arc<Viewpoint>)>>(&mut self, viewpoints: I) {
        viewpoints.into_iter().for_each(|(revision, viewpoint)| self.insert(revision, viewpoint));
    }
}

/// A look at points one after the other, which asks first who saw through the point before.
#[derive(Debug, Clone)]
pub struct Gaze<'a> {
    set: &'a ViewpointSet,
    last: Option<&'a Viewpoint>,
}

impl Gaze<'_> {
    /// [`ViewpointSet::sees_through`].
    #[inline]
    pub fn sees_through(&mut self, point_m: [f64; 3]) -> bool {
        if self.last.is_some_and(|viewpoint| viewpoint.sees_through(point_m)) {
            return true;
        }
        let observer = self.set.observer(point_m);
        self.last = observer.or(self.last);
        observer.is_some()
    }
}
