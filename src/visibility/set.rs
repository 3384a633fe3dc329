//! The viewpoints of a map.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Viewpoint;
use super::reach::{Reach, ReachIndex, Slot};

/// The viewpoints of a map, by the revisions of the scans that left them, with an index of who looked where.
#[derive(Debug, Clone, Default)]
pub struct ViewpointSet {
    slots: Vec<Option<Kept>>,
    by_revision: BTreeMap<u64, Slot>,
    unused: Vec<Slot>,
    index: ReachIndex,
    bytes: usize,
    stored_bytes: usize,
}

/// A viewpoint, and where it is in the index.
#[derive(Debug, Clone)]
struct Kept {
    viewpoint: Arc<Viewpoint>,
    reach: Reach,
}

impl Kept {
    fn memory_bytes(&self) -> usize {
        self.viewpoint.memory_bytes() + self.reach.memory_bytes()
    }
}

impl ViewpointSet {
    /// Keeps the viewpoint of the scan that made `revision`.
    pub fn insert(&mut self, revision: u64, viewpoint: Arc<Viewpoint>) {
        self.remove(revision);
        let reach = Reach::of(&viewpoint);
        let slot = self.unused.pop().unwrap_or_else(|| {
            self.slots.push(None);
            (self.slots.len() - 1) as Slot
        });
        self.index.insert(slot, &reach);
        self.by_revision.insert(revision, slot);
        let kept = Kept { viewpoint, reach };
        self.bytes += kept.memory_bytes();
        self.stored_bytes += kept.viewpoint.image().stored_bytes();
        self.slots[slot as usize] = Some(kept);
    }

    /// Forgets the viewpoint of the scan that made `revision`; returns it, where there was one.
    pub fn remove(&mut self, revision: u64) -> Option<Arc<Viewpoint>> {
        let slot = self.by_revision.remove(&revision)?;
        let kept = self.slots[slot as usize].take()?;
        self.index.remove(slot, &kept.reach);
        self.unused.push(slot);
        self.bytes -= kept.memory_bytes();
        self.stored_bytes -= kept.viewpoint.image().stored_bytes();
        Some(kept.viewpoint)
    }

    /// The viewpoints, with the revisions of the scans that left them, in that order.
    pub fn iter(&self) -> impl Iterator<Item = (u64, &Arc<Viewpoint>)> {
        self.by_revision.iter().filter_map(|(&revision, &slot)| Some((revision, &self.kept(slot)?.viewpoint)))
    }

    /// The viewpoint of the scan that made `revision`.
    pub fn get(&self, revision: u64) -> Option<&Arc<Viewpoint>> {
        Some(&self.kept(*self.by_revision.get(&revision)?)?.viewpoint)
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

    /// Looks at many points that lie near each other, one after the other.
    pub fn gaze(&self) -> Gaze<'_> {
        Gaze { set: self, last: None }
    }

    /// The part of space that the viewpoint of `revision` can have changed the state of: boxes (map frame, meters: the smallest and the
    /// largest coordinates).
    pub fn reach_m(&self, revision: u64) -> impl Iterator<Item = [[f64; 3]; 2]> {
        let kept = self.by_revision.get(&revision).and_then(|slot| self.kept(*slot));
        kept.into_iter().flat_map(|kept| kept.reach.boxes_m())
    }

    fn observer(&self, point_m: [f64; 3]) -> Option<&Viewpoint> {
        let candidates = self.index.around(point_m).filter_map(|slot| Some(&*self.kept(slot)?.viewpoint));
        candidates.into_iter().find(|viewpoint| viewpoint.sees_through(point_m))
    }

    fn kept(&self, slot: Slot) -> Option<&Kept> {
        self.slots.get(slot as usize)?.as_ref()
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
