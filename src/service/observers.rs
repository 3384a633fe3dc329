//! Which scans touched a voxel.
//!
//! The journal knows. It is read backwards, segment by segment, so that the newest scans are found first and no more is read
//! than is needed, nor held than one segment.

use std::collections::{BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use super::deletion::in_range;
use super::hosted_map::HostedMap;
use super::point_query::without_voxel;
use super::resource_budget::ResourceBudget;
use super::{
    Limits, MapService, ObservedVoxel, ObserversAnswer, ObserversRequest, ObservingScan, Outcome,
    ServiceError, ended_early,
};
use crate::map::{Change, MapName};
use crate::store::{JournalPart, MapFolder, StoreError};
use crate::util::StopSignal;
use crate::voxel::VoxelKey;

/// Whom memory is lent to, in refusals.
const OBSERVERS: &str = "a list of observers";

impl MapService {
    /// The scans that touched a voxel and were not undone, newest first, as far back as the journal reaches: some of them
    /// where that takes longer than `observers_time_max_s`.
    ///
    /// # Errors
    /// `InvalidArgument` for a level that is none, a point in no voxel, a key out of the level's range;
    /// `FailedPrecondition` where maps are kept in memory only; `ResourceExhausted` where there is no memory for a segment of
    /// the journal; `NotFound`.
    pub async fn list_observers(
        &self,
        map: &MapName,
        request: ObserversRequest,
    ) -> Result<ObserversAnswer, ServiceError> {
        let work = async {
            let map = self.map(map)?;
            map.check_level(request.level)?;
            let voxel = map.observed_voxel(&request)?;
            let folder = map.folder.clone().ok_or_else(|| map.no_journal("a list of observers"))?;
            let inner = self.inner.clone();
            let find = move |stop: StopSignal<'_>| {
                let limits = &inner.settings.limits;
                let stop = stop.by(Instant::now() + Duration::from_secs_f64(limits.observers_time_max_s));
                let search = Search { map: &map, folder: &folder, voxel, level: request.level, stop };
                search.observers(limits, &inner.budget)
            };
            self.inner.observers.run(find).await?
        };
        self.observed("ListObservers", Some(map), work, |_| Outcome::Read).await
    }
}

impl HostedMap {
    /// The voxel that is asked about.
    fn observed_voxel(&self, request: &ObserversRequest) -> Result<VoxelKey, ServiceError> {
        let lattice = self.map.lattice();
        match request.voxel {
            ObservedVoxel::Key(key) => in_range("key", key, request.level),
            ObservedVoxel::Of(point) => match lattice.from_map().key(point) {
                Some(finest) => Ok(finest.ancestor(request.level)),
                None => Err(without_voxel("point", point, lattice)),
            },
        }
    }
}

/// A search for the scans that touched a voxel.
struct Search<'a> {
    map: &'a HostedMap,
    folder: &'a MapFolder,
    voxel: VoxelKey,
    level: u32,
    stop: StopSignal<'a>,
}

/// The observers that one part of the journal knows, newest first.
struct Observers {
    scans: Vec<ObservingScan>,
    /// The part has more than these.
    has_more: bool,
}

impl Search<'_> {
    fn observers(&self, limits: &Limits, budget: &ResourceBudget) -> Result<ObserversAnswer, ServiceError> {
        let (trajectory, version) = self.map.map.trajectory_and_version();
        let undone: BTreeSet<u64> = trajectory.withdrawn().iter().map(|withdrawn| withdrawn.change).collect();
        let parts = self.folder.journal_parts(version.revision);
        let reaches_back_to = parts.last().map_or(version.revision + 1, |oldest| oldest.first);
        let (mut scans, mut older_scans) = (Vec::new(), reaches_back_to > 1);
        for part in parts {
            let most = limits.observers_max - scans.len();
            let found = if most == 0 { None } else { self.in_part(&part, &undone, most, budget)? };
            older_scans |= found.as_ref().is_none_or(|found| found.has_more);
            let Some(found) = found else { break };
            scans.extend(found.scans);
        }
        if self.stop.is_cancelled() {
            return Err(ended_early(self.stop));
        }
        let version = self.map.version(version);
        Ok(ObserversAnswer { voxel: self.voxel, scans, older_scans, version })
    }

    /// The newest `most` observers that a part knows; none where it is not kept any more, or the time is up.
    fn in_part(
        &self,
        part: &JournalPart,
        undone: &BTreeSet<u64>,
        most: usize,
        budget: &ResourceBudget,
    ) -> Result<Option<Observers>, ServiceError> {
        let unreadable = |error: StoreError| match self.folder.keeps_part(part) || self.folder.is_gone() {
            true => Err(self.map.unreadable(&error)),
            false => Ok(None),
        };
        let bytes = match self.folder.bytes_of_part(part) {
            Ok(bytes) => bytes,
            Err(error) => return unreadable(error),
        };
        // The segment, and what one record of it becomes.
        let _memory = budget.reserve_transient(2 * bytes, OBSERVERS)?;
        let mut newest = VecDeque::new();
        for change in self.folder.changes_of_part(part) {
            if self.stop.is_stopped() {
                return Ok(None);
            }
            let (revision, change) = match change {
                Ok(change) => change,
                Err(error) => return unreadable(error),
            };
            let Change::Insertion(scan) = change else { continue };
            if !undone.contains(&revision) && scan.voxels.touches(self.voxel, self.level) {
                newest.push_back(ObservingScan { revision, scan: scan.pose.into() });
                // One more than may be told, so that it is known of.
                if newest.len() > most + 1 {
                    newest.pop_front();
                }
            }
        }
        let has_more = newest.len() > most;
        Ok(Some(Observers { scans: newest.into_iter().rev().take(most).collect(), has_more }))
    }
}
