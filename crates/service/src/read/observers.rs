//! Which scans touched a voxel.
//!
//! The journal knows. It is read backwards, segment by segment, so that the newest scans are found first and no more is
//! read than is needed, nor held than one segment.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::Outcome;
use crate::request::{
    ObservedVoxel, ObserversAnswer, ObserversRequest, ObservingScan, key_in_range, without_voxel,
};
use crate::resources::ResourceBudget;
use crate::work::ended_early;
use mrol_map::map::MapName;
use mrol_map::util::StopSignal;
use mrol_map::voxel::VoxelKey;
use mrol_store::{JournalPart, MapFolder, StoreError, VoxelMention};

/// Name under which the memory is reserved, for refusals.
const OBSERVERS: &str = "a list of observers";

impl MapService {
    /// The scans that touched a voxel and were not undone, newest first, as far back as the journal reaches: some of
    /// them where that takes longer than `observers_time_max_s`.
    ///
    /// # Errors
    /// `InvalidArgument` for a level that is none, a point in no voxel, a key out of the level's range;
    /// `FailedPrecondition` where maps are kept in memory only; `ResourceExhausted` where there is no memory for a
    /// segment of the journal; `NotFound`.
    pub async fn list_observers(
        &self,
        map: &MapName,
        request: ObserversRequest,
    ) -> Result<ObserversAnswer, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
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
            self.inner.lanes.observers.run(&self.asker, find).await?
        };
        self.observed("ListObservers", Some(map), work, |_| Outcome::Read).await
    }
}

impl HostedMap {
    /// The voxel that is asked about.
    fn observed_voxel(&self, request: &ObserversRequest) -> Result<VoxelKey, ServiceError> {
        let lattice = self.map.lattice();
        match request.voxel {
            ObservedVoxel::Key(key) => key_in_range("key", key, request.level),
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
        let mut undone: BTreeSet<u64> =
            trajectory.withdrawn().iter().map(|withdrawn| withdrawn.change).collect();
        let parts = self.folder.journal_parts(version.revision);
        let reaches_back_to = parts.last().map_or(version.revision + 1, |oldest| oldest.first);
        let (mut scans, mut older_scans) = (Vec::new(), reaches_back_to > 1);
        for part in parts {
            let most = limits.observers_max - scans.len();
            let found = if most == 0 { None } else { self.in_part(&part, &mut undone, most, budget)? };
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
        undone: &mut BTreeSet<u64>,
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
        let _segment = budget.reserve_transient(bytes, OBSERVERS)?;
        let mut touching = Vec::new();
        for record in self.folder.records_of_part(part) {
            self.stop.give_way();
            if self.stop.is_stopped() {
                return Ok(None);
            }
            let (revision, record) = match record {
                Ok(record) => record,
                Err(error) => return unreadable(error),
            };
            let _read = budget.reserve_transient(record.memory_bytes(), OBSERVERS)?;
            let damaged = |reason| {
                let message = format!("the record of revision {revision} cannot be read: {reason}");
                ServiceError::new(Reason::JournalUnreadable, message)
            };
            match record.mention(self.voxel, self.level).map_err(damaged)? {
                VoxelMention::Touched(scan) => {
                    touching.push(ObservingScan { revision, scan: (*scan).into() });
                }
                // What was undone long ago the trajectory knows no more. An undo lies behind what it takes back.
                VoxelMention::Undone(changes) => undone.extend(changes),
                VoxelMention::Nothing => {}
            }
        }
        touching.retain(|scan| !undone.contains(&scan.revision));
        let has_more = touching.len() > most;
        Ok(Some(Observers { scans: touching.into_iter().rev().take(most).collect(), has_more }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::request::{Deletion, DeletionTarget, ScanRequest, Undo, UndoTarget};
    use crate::settings::ServiceSettings;
    use mrol_map::geometry::{Point, Pose};
    use mrol_map::map::{MapSettings, RobotName};
    use mrol_map::mapping::Guess;
    use mrol_store::{OpeningProgress, StoreSettings};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::cell::Cell;
    use tempfile::TempDir;

    const RESOLUTION_M: f32 = 0.1;

    fn map() -> MapName {
        MapName::new("a").unwrap()
    }

    fn key(index: [i32; 3]) -> VoxelKey {
        VoxelKey::new(index).unwrap()
    }

    /// A service whose maps lie in `data`, in segments of so many bytes.
    async fn service(data: &TempDir, segment_bytes_max: u64, limits: Limits) -> MapService {
        let settings = ServiceSettings {
            data_dir: Some(data.path().to_owned()),
            store: StoreSettings { segment_bytes_max, ..StoreSettings::default() },
            limits,
            ..ServiceSettings::default()
        };
        let open = move || MapService::open(settings, &OpeningProgress::default());
        tokio::task::spawn_blocking(open).await.unwrap().unwrap()
    }

    /// A scan of the centers of these voxels.
    async fn insert(service: &MapService, scan_id: u64, voxels: &[[i32; 3]]) -> u64 {
        let center = |index: &[i32; 3]| Point::from(index.map(|i| (i as f32 + 0.5) * RESOLUTION_M));
        let points: Vec<_> = voxels.iter().map(center).collect();
        let scan = ScanRequest {
            scan_id: Some(scan_id),
            guess: Guess::Pose(Pose::identity()),
            at_guess: true,
            ..ScanRequest::new(RobotName::new("r").unwrap(), points.into())
        };
        service.insert_scan(&map(), scan).await.unwrap().version.revision
    }

    async fn observers(service: &MapService, voxel: [i32; 3], level: u32) -> (Vec<u64>, bool) {
        let request = ObserversRequest { voxel: ObservedVoxel::Key(key(voxel)), level };
        let answer = service.list_observers(&map(), request).await.unwrap();
        assert_eq!(answer.voxel, key(voxel));
        (answer.scans.iter().map(|scan| scan.revision).collect(), answer.older_scans)
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn they_are_the_newest_scans_that_touched_the_voxel_and_were_not_undone() {
        for (segment_bytes_max, observers_max) in [(1, 100), (400, 3), (64 << 20, 2)] {
            let (data, mut random) = (tempfile::tempdir().unwrap(), ChaCha8Rng::seed_from_u64(observers_max));
            let limits = Limits { observers_max: observers_max as usize, ..Limits::default() };
            let service = service(&data, segment_bytes_max, limits).await;
            service.create_map(map(), MapSettings::new(RESOLUTION_M.into(), 6)).await.unwrap();
            let mut scans: Vec<(u64, Vec<[i32; 3]>)> = Vec::new();
            for scan_id in 0..40 {
                let mut near = || std::array::from_fn(|_| random.random_range(-3..3));
                let voxels: Vec<[i32; 3]> = (0..3).map(|_| near()).collect();
                scans.push((insert(&service, scan_id, &voxels).await, voxels));
                match scan_id % 8 {
                    5 => {
                        let (revision, _) = scans.remove(random.random_range(0..scans.len()));
                        let undo = Undo { target: UndoTarget::Revision(revision), request_id: None };
                        service.undo(&map(), undo).await.unwrap();
                    }
                    // A scan touched a voxel whether or not it is there still.
                    7 => {
                        let target = DeletionTarget::Keys(vec![key(scans[0].1[0])]);
                        let deletion = Deletion { target, level: 0, request_id: None };
                        service.delete_voxels(&map(), deletion).await.unwrap();
                    }
                    _ => {}
                }
            }
            for (voxel, level) in (-3..3).flat_map(|i| (0..6).map(move |level| ([i >> level; 3], level))) {
                let touched = |(_, voxels): &&(u64, Vec<[i32; 3]>)| {
                    voxels.iter().any(|of_scan| of_scan.map(|i| i >> level) == voxel)
                };
                let all: Vec<u64> =
                    scans.iter().rev().filter(touched).map(|(revision, _)| *revision).collect();
                let (found, has_older) = observers(&service, voxel, level).await;
                let expected = &all[..all.len().min(observers_max as usize)];
                assert_eq!(found, expected, "{voxel:?} of level {level}");
                // There may be older ones where not all was read; where there are, it says so.
                assert!(has_older || all.len() <= found.len(), "{voxel:?} of level {level}");
                assert!(!has_older || found.len() == observers_max as usize, "{voxel:?} of level {level}");
            }
        }
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn what_the_journal_does_not_reach_back_to_and_what_takes_too_long_is_said_to_be_older() {
        let data = tempfile::tempdir().unwrap();
        let service = service(&data, 1, Limits::default()).await;
        service.create_map(map(), MapSettings::new(RESOLUTION_M.into(), 4)).await.unwrap();
        insert(&service, 1, &[[0; 3]]).await;
        assert_eq!(observers(&service, [0; 3], 0).await, (vec![1], false));
        let file = service.snapshot_map(&map()).await.unwrap();
        let restored = service.restore_map(map(), file.bytes, true).await.unwrap();
        assert_eq!(observers(&service, [0; 3], 0).await, (vec![], true));
        let revision = insert(&service, 2, &[[0; 3], [1, 0, 0]]).await;
        assert_eq!(revision, restored.version.revision + 1);
        assert_eq!(observers(&service, [0; 3], 0).await, (vec![revision], true));

        let (hosted, folder) =
            (service.map(&map()).await.unwrap(), service.map(&map()).await.unwrap().folder.clone());
        let search = |stop| {
            let folder = folder.as_ref().unwrap();
            Search { map: &hosted, folder, voxel: key([0; 3]), level: 0, stop }
                .observers(service.limits(), &service.inner.budget)
        };
        let late = search(StopSignal::NEVER.by(Instant::now())).unwrap();
        assert!(late.scans.is_empty() && late.older_scans);
        let looks = Cell::new(0);
        let gone = || looks.replace(looks.get() + 1) > 0;
        assert_eq!(search(StopSignal::when(&gone)).unwrap_err().reason, Reason::CallerGone);
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn what_was_undone_so_long_ago_that_the_trajectory_forgot_it_does_not_come_back() {
        let data = tempfile::tempdir().unwrap();
        // In one segment, and in a segment each.
        for (name, segment_bytes_max) in [("one", 64 << 20), ("each", 1)] {
            let data = TempDir::with_prefix_in(name, &data).unwrap();
            let service = service(&data, segment_bytes_max, Limits::default()).await;
            service.create_map(map(), MapSettings::new(RESOLUTION_M.into(), 4)).await.unwrap();
            let (undone, kept) = (insert(&service, 1, &[[0; 3]]).await, insert(&service, 2, &[[0; 3]]).await);
            let undo = Undo { target: UndoTarget::Revision(undone), request_id: None };
            let head = service.undo(&map(), undo).await.unwrap().version.revision;
            let hosted = service.map(&map()).await.unwrap();
            let spacing = &hosted.folder.as_ref().unwrap().settings().trajectory_spacing;
            hosted.map.committer().thin(head + 1, spacing);
            assert!(hosted.map.trajectory_and_version().0.withdrawn().is_empty());
            assert_eq!(observers(&service, [0; 3], 0).await, (vec![kept], false));
        }
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_voxel_that_is_none_and_a_map_without_a_journal_are_refused() {
        let service = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        service.create_map(map(), MapSettings::new(RESOLUTION_M.into(), 4)).await.unwrap();
        let of = async |voxel, level| service.list_observers(&map(), ObserversRequest { voxel, level }).await;
        let far = ObservedVoxel::Of(Point::new(0.0, 1e9, 0.0));
        let nowhere = ObservedVoxel::Of(Point::new(0.0, f32::NAN, 0.0));
        for (voxel, level, reason) in [
            (far, 0, Reason::PointOutOfRange),
            (nowhere, 0, Reason::PointNotFinite),
            (ObservedVoxel::Key(key([1 << 19, 0, 0])), 1, Reason::KeyOutOfRange),
            (ObservedVoxel::Key(key([0; 3])), 4, Reason::LevelOutOfRange),
            (ObservedVoxel::Key(key([0; 3])), 3, Reason::NoJournal),
        ] {
            let error = of(voxel, level).await.unwrap_err();
            assert_eq!(error.reason, reason, "{error}");
        }
    }
}
