//! The viewpoints of a map.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::coverage::{CoverageIndex, Slot};
use super::viewpoint::Viewpoint;
use crate::geometry::{Pose, pose_difference};
use crate::util::Digest;
use crate::visibility::image::AbsenceEvidence;

/// The viewpoints of a map, by the revisions of the scans that left them, with an index of what each covers.
#[derive(Clone, Default)]
pub struct ViewpointSet {
    slots: Vec<Option<(u64, Arc<Viewpoint>)>>,
    /// Where each was taken: those near a place are found by a walk through memory.
    places_m: Vec<[f32; 3]>,
    by_revision: BTreeMap<u64, Slot>,
    unused: Vec<Slot>,
    index: CoverageIndex,
    bytes: usize,
    stored_bytes: usize,
    /// The sum of the hashes of the viewpoints, each with its revision, modulo 2^64.
    hash: u64,
}

/// How far an f32 of a place in a map may be off, meters.
const PLACE_ERROR_M: f64 = 0.01;

impl ViewpointSet {
    /// Keeps the viewpoint of the scan that made `revision`.
    pub fn insert(&mut self, revision: u64, viewpoint: Arc<Viewpoint>) {
        self.remove(revision);
        let slot = self.unused.pop().unwrap_or_else(|| {
            self.slots.push(None);
            self.places_m.push([0.0; 3]);
            (self.slots.len() - 1) as Slot
        });
        self.index.insert(slot, viewpoint.coverage());
        self.by_revision.insert(revision, slot);
        self.bytes += viewpoint.memory_bytes();
        self.stored_bytes += viewpoint.image().stored_bytes();
        self.hash = self.hash.wrapping_add(hash_at(revision, &viewpoint));
        self.places_m[slot as usize] =
            viewpoint.map_from_sensor().translation.vector.map(|c| c as f32).into();
        self.slots[slot as usize] = Some((revision, viewpoint));
    }

    /// Forgets the viewpoint of the scan that made `revision`; returns it, where there was one.
    pub fn remove(&mut self, revision: u64) -> Option<Arc<Viewpoint>> {
        let slot = self.by_revision.remove(&revision)?;
        let (_, viewpoint) = self.slots[slot as usize].take()?;
        self.index.remove(slot, viewpoint.coverage());
        self.unused.push(slot);
        self.bytes -= viewpoint.memory_bytes();
        self.stored_bytes -= viewpoint.image().stored_bytes();
        self.hash = self.hash.wrapping_sub(hash_at(revision, &viewpoint));
        Some(viewpoint)
    }

    /// The viewpoints, with the revisions of the scans that left them, in that order.
    pub fn iter(&self) -> impl Iterator<Item = (u64, &Arc<Viewpoint>)> {
        self.by_revision.iter().filter_map(|(&revision, &slot)| Some((revision, self.at(slot)?)))
    }

    /// [`ViewpointSet::iter`] from `revision` on.
    pub fn iter_from(&self, revision: u64) -> impl Iterator<Item = (u64, &Arc<Viewpoint>)> {
        self.by_revision.range(revision..).filter_map(|(&revision, &slot)| Some((revision, self.at(slot)?)))
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

    /// Hash of the viewpoints and their revisions: equal for equal sets, whatever came and went before.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// True where one of the viewpoints proves `point_m` (map frame, meters) to be free.
    pub fn is_free(&self, point_m: [f64; 3]) -> bool {
        self.observer(point_m).is_some()
    }

    /// The parts of space that a viewpoint may have seen a point of, each once: boxes of the map frame, as the smallest
    /// and the largest coordinates, meters. Boxes of viewpoints that reach further are larger, and may hold others.
    pub fn boxes_m(&self) -> impl Iterator<Item = [[f64; 3]; 2]> {
        self.index.boxes_m()
    }

    /// The viewpoints that may have seen beyond a point between two corners (map frame, meters), first those that saw
    /// most there.
    ///
    /// Takes longer the further apart the corners are, against how far viewpoints see.
    pub fn within(&self, low_m: [f64; 3], high_m: [f64; 3]) -> impl Iterator<Item = &Viewpoint> {
        self.index.within(low_m, high_m).into_iter().filter_map(|slot| self.at(slot).map(Arc::as_ref))
    }

    /// Looks at many points that lie near each other, one after the other.
    pub fn cache(&self) -> ViewpointCache<'_> {
        ViewpointCache { set: self, last: None }
    }

    /// True where a viewpoint may have looked into a box of the map: the smallest and the largest coordinates, meters.
    pub fn may_cover(&self, low_m: [f64; 3], high_m: [f64; 3]) -> bool {
        self.index.may_cover(low_m, high_m)
    }

    /// True where one of the viewpoints but that of `revision` saw beyond `point_m`.
    pub fn is_free_by_others(&self, point_m: [f64; 3], revision: u64) -> bool {
        let own = self.by_revision.get(&revision);
        let others = self.index.around(point_m).filter(|slot| Some(slot) != own);
        others.filter_map(|slot| self.at(slot)).any(|viewpoint| viewpoint.is_free(point_m))
    }

    /// True where a viewpoint of a scan after `revision` proves that nothing is at `point_m`, see
    /// [`RangeImage::proves_absent`].
    ///
    /// [`RangeImage::proves_absent`]: crate::visibility::RangeImage::proves_absent
    pub fn later_proves_absent(&self, point_m: [f64; 3], least: AbsenceEvidence, revision: u64) -> bool {
        let candidates =
            self.index.around(point_m).filter_map(|slot| self.slots.get(slot as usize)?.as_ref());
        candidates
            .filter(|(made, _)| *made > revision)
            .any(|(_, viewpoint)| viewpoint.image().proves_absent(viewpoint.offset(point_m), least))
    }

    /// True where a viewpoint is at most `distance_m` from `map_from_sensor` and turned by at most `rotation_deg`
    /// against it.
    pub fn any_near(&self, map_from_sensor: &Pose, distance_m: f64, rotation_deg: f64) -> bool {
        let place = map_from_sensor.translation.vector;
        let near = self.places_m.iter().zip(&self.slots).filter(|(viewpoint_m, _)| {
            let squared: f64 = (0..3).map(|axis| (f64::from(viewpoint_m[axis]) - place[axis]).powi(2)).sum();
            // f32 places find which viewpoints may be near; what decides is the pose.
            squared.sqrt() <= distance_m + PLACE_ERROR_M
        });
        near.filter_map(|(_, viewpoint)| viewpoint.as_ref()).any(|(_, viewpoint)| {
            let (meters, degrees) = pose_difference(viewpoint.map_from_sensor(), map_from_sensor);
            meters <= distance_m && degrees <= rotation_deg
        })
    }

    fn observer(&self, point_m: [f64; 3]) -> Option<&Viewpoint> {
        let mut candidates = self.index.around(point_m).filter_map(|slot| self.at(slot));
        candidates.find(|viewpoint| viewpoint.is_free(point_m)).map(Arc::as_ref)
    }

    fn at(&self, slot: Slot) -> Option<&Arc<Viewpoint>> {
        Some(&self.slots.get(slot as usize)?.as_ref()?.1)
    }
}

fn hash_at(revision: u64, viewpoint: &Viewpoint) -> u64 {
    Digest::default().word(revision).word(viewpoint.hash()).finish()
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

/// A cache for points that are asked one after the other: the viewpoint that proved the last one free is asked first.
#[derive(Debug, Clone)]
pub struct ViewpointCache<'a> {
    set: &'a ViewpointSet,
    last: Option<&'a Viewpoint>,
}

impl ViewpointCache<'_> {
    /// [`ViewpointSet::is_free`].
    #[inline]
    pub fn is_free(&mut self, point_m: [f64; 3]) -> bool {
        if self.last.is_some_and(|viewpoint| viewpoint.is_free(point_m)) {
            return true;
        }
        let observer = self.set.observer(point_m);
        self.last = observer.or(self.last);
        observer.is_some()
    }
}
