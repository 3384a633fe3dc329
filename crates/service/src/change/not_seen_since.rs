//! Which voxels of a region no scan touched any more, although a viewpoint saw through them.

use crate::commit::Refusal;
use crate::error::{Reason, ServiceError};
use crate::maps::HostedMap;
use crate::request::NotSeenSince;
use crate::resources::{Reservation, ResourceBudget};
use crate::work::{check_not_stopped, ended_early};
use mrol_map::map::{Change, MultiResolutionMap, WithdrawnChange};
use mrol_map::util::StopSignal;
use mrol_map::visibility::AbsenceEvidence;
use mrol_map::voxel::{BlockMask, VoxelKey, VoxelSet};
use mrol_store::MapFolder;

/// Name under which the memory is reserved, for refusals.
const UNSEEN: &str = "a deletion of what was not seen";
/// How far behind a voxel a scan has to have seen, in finest voxels: noise puts surfaces two voxels off.
const MARGIN_VOXELS: f32 = 3.0;
/// Blocks that are looked at between two checks of the stop signal.
const BLOCKS_PER_STOP_CHECK: usize = 64;

/// The voxels of a region that scans since a revision saw through and did not touch, as far as the journal was read.
#[derive(Debug)]
pub(super) struct Unseen {
    voxels: VoxelSet,
    /// The last revision that was read.
    revision: u64,
    /// The changes that were taken back then.
    withdrawn: Vec<WithdrawnChange>,
    _reserved: Reservation,
}

impl HostedMap {
    /// Finds them, while scans go on coming in.
    pub(super) fn find_unseen(
        &self,
        target: &NotSeenSince,
        level: u32,
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) -> Result<Unseen, ServiceError> {
        let folder = self.folder.as_ref().ok_or_else(|| self.no_journal(UNSEEN))?;
        let (trajectory, version) = self.map.trajectory_and_version();
        let withdrawn = trajectory.withdrawn().to_vec();
        if target.revision > version.revision {
            let message = format!(
                "not_seen_since must be a revision that map {} has reached, at most {}, got {}",
                self.name, version.revision, target.revision
            );
            return Err(ServiceError::new(Reason::BadRevision, message));
        }
        let reaches_back_to = folder.undo_from(&withdrawn).saturating_sub(1);
        if target.revision < reaches_back_to {
            let message = format!(
                "not_seen_since must be at least {reaches_back_to} for map {}, got {}: the journal is kept from there on, see \
                 store.undo_revisions and store.undo_bytes_max",
                self.name, target.revision
            );
            return Err(ServiceError::new(Reason::OutsideUndoWindow, message));
        }
        let reserved = budget.reserve_transient(2 * self.map.set_bytes() as u64, UNSEEN)?;
        let long_read = self.map.long_read();
        let view = long_read.view().with_viewpoints();
        let there = view.finest_in_until(&target.region, level, stop);
        let viewpoints = view.viewpoints().cloned().unwrap_or_default();
        let revision = view.version().revision;
        drop(view);
        drop(long_read);
        let lattice = self.map.lattice();
        let voxel_m = lattice.resolution_m(0) as f32;
        let least = AbsenceEvidence { margin_m: MARGIN_VOXELS * voxel_m, gap_max_m: voxel_m };
        let seen_through = stop.paced(there.blocks(), BLOCKS_PER_STOP_CHECK).map(|(block, mask)| {
            let mut seen_through = BlockMask::EMPTY;
            for cell in mask.cells(0) {
                let center_m = lattice.center_m(cell.voxel(*block), 0);
                if viewpoints.later_proves_absent(center_m, least, target.revision) {
                    seen_through.insert(cell);
                }
            }
            (*block, seen_through)
        });
        let voxels = seen_through.collect();
        check_not_stopped(stop)?;
        let mut unseen = Unseen { voxels, revision: target.revision, withdrawn, _reserved: reserved };
        unseen.read_to(revision, self, folder, stop)?;
        Ok(unseen)
    }
}

impl Unseen {
    /// The voxels that go, while nobody else can change the map.
    pub(super) fn decided(
        mut self,
        map: &HostedMap,
        core: &MultiResolutionMap,
        stop: StopSignal<'_>,
    ) -> Result<VoxelSet, Refusal> {
        let folder = map.folder.as_ref().ok_or_else(|| map.no_journal(UNSEEN))?;
        // A scan that was taken back touched nothing, and its viewpoint saw nothing.
        if core.trajectory().withdrawn() != self.withdrawn {
            return Err(Refusal::Stale);
        }
        self.read_to(core.revision(), map, folder, stop)?;
        let view = core.view();
        let there = |(block, mask): &(VoxelKey, BlockMask)| {
            let cells = mask.cells(0).filter(|cell| view.contains(cell.voxel(*block), 0));
            let mut there = BlockMask::EMPTY;
            cells.for_each(|cell| {
                there.insert(cell);
            });
            (*block, there)
        };
        Ok(self.voxels.blocks().iter().map(there).collect())
    }

    /// Leaves out what the scans up to `revision` touched.
    fn read_to(
        &mut self,
        revision: u64,
        map: &HostedMap,
        folder: &MapFolder,
        stop: StopSignal<'_>,
    ) -> Result<(), ServiceError> {
        if self.revision >= revision {
            return Ok(());
        }
        let gone = || {
            let message = format!(
                "the journal of map {} was cut behind revision {} meanwhile: name a later one",
                map.name, self.revision
            );
            ServiceError::new(Reason::OutsideUndoWindow, message)
        };
        let changes = folder.changes_from(self.revision + 1).ok_or_else(gone)?;
        for change in changes {
            if stop.is_stopped() {
                return Err(ended_early(stop));
            }
            let (made, change) = change.map_err(|error| map.unreadable(&error))?;
            if made > revision {
                break;
            }
            let is_withdrawn = self.withdrawn.iter().any(|withdrawn| withdrawn.change == made);
            if let (Change::Insertion(scan), false) = (change, is_withdrawn) {
                self.voxels = without(&self.voxels, &scan.voxels);
            }
        }
        self.revision = revision;
        Ok(())
    }
}

/// The voxels that are not among `touched`.
fn without(voxels: &VoxelSet, touched: &VoxelSet) -> VoxelSet {
    let mut touched = touched.blocks().iter().peekable();
    let left = voxels.blocks().iter().map(|&(block, mask)| {
        while touched.next_if(|(other, _)| *other < block).is_some() {}
        let of_block = touched.next_if(|(other, _)| *other == block);
        (block, of_block.map_or(mask, |(_, touched)| mask.difference(touched)))
    });
    left.filter(|(_, mask)| !mask.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map_service::MapService;
    use crate::request::{Deletion, DeletionTarget, ScanRequest, Undo, UndoTarget};
    use crate::settings::ServiceSettings;
    use mrol_map::geometry::{Point, Pose};
    use mrol_map::map::{MapName, MapSettings, Region, RobotName};
    use mrol_map::mapping::Guess;
    use mrol_store::OpeningProgress;
    use tempfile::TempDir;

    fn map() -> MapName {
        MapName::new("a").unwrap()
    }

    async fn service(data: &TempDir) -> MapService {
        let settings =
            ServiceSettings { data_dir: Some(data.path().to_owned()), ..ServiceSettings::default() };
        let open = move || MapService::open(settings, &OpeningProgress::default());
        let service = tokio::task::spawn_blocking(open).await.unwrap().unwrap();
        service.create_map(map(), MapSettings::new(0.1, 4)).await.unwrap();
        service
    }

    /// A wall at x = 4 m, seen from `y_m`, with a plate 1 m before it where one is.
    async fn insert(service: &MapService, scan_id: u64, y_m: f32, plate: bool) -> u64 {
        let point = |i: usize| {
            let (y, z) = ((i % 160) as f32 * 0.025 - 2.0, (i / 160) as f32 * 0.025 - 1.0);
            let is_plate = plate && y.abs() < 0.8 && z.abs() < 0.5;
            let share = if is_plate { 0.75 } else { 1.0 };
            Point::new(4.05 * share, (y - y_m) * share, z * share)
        };
        let points: Vec<_> = (0..160 * 80).map(point).collect();
        let scan = ScanRequest {
            scan_id: Some(scan_id),
            guess: Guess::Pose(Pose::translation(0.0, f64::from(y_m), 0.0)),
            at_guess: true,
            ..ScanRequest::new(RobotName::new("r").unwrap(), points.into())
        };
        service.insert_scan(&map(), scan).await.unwrap().version.revision
    }

    fn not_seen_since(revision: u64) -> Deletion {
        let region = Region::Box { min_m: [2.0, -2.0, -2.0], max_m: [5.0, 2.0, 2.0] };
        let target = DeletionTarget::NotSeenSince(NotSeenSince { region, revision });
        Deletion { target, level: 0, request_id: None }
    }

    #[tokio::test]
    async fn what_scans_saw_through_and_touched_no_more_goes_and_comes_back_by_undo() {
        let data = TempDir::new().unwrap();
        let service = service(&data).await;
        let with_plate = insert(&service, 1, 0.0, true).await;
        let before = service.map_info(&map()).await.unwrap().levels[0].voxels;
        // Nobody looked again.
        assert_eq!(service.delete_voxels(&map(), not_seen_since(with_plate)).await.unwrap().removed, 0);
        insert(&service, 2, 0.6, false).await;
        let behind = service.map_info(&map()).await.unwrap().levels[0].voxels - before;
        let deleted = service.delete_voxels(&map(), not_seen_since(with_plate)).await.unwrap();
        // The plate is 12 x 7 voxels or a row more; nothing else goes, and a rim of it may stay.
        assert!((70..=120).contains(&deleted.removed), "{} went, {behind} had come", deleted.removed);
        let again = service.delete_voxels(&map(), not_seen_since(with_plate)).await.unwrap();
        assert_eq!((again.removed, again.version.revision), (0, deleted.version.revision));
        let undo = Undo { target: UndoTarget::Revision(deleted.version.revision), request_id: None };
        assert_eq!(service.undo(&map(), undo).await.unwrap().restored, deleted.removed);
        // Since the scan that saw through it nothing did.
        assert_eq!(service.delete_voxels(&map(), not_seen_since(2)).await.unwrap().removed, 0);
        // A scan that is undone saw nothing.
        let undo = Undo { target: UndoTarget::Revision(2), request_id: None };
        service.undo(&map(), undo).await.unwrap();
        assert_eq!(service.delete_voxels(&map(), not_seen_since(with_plate)).await.unwrap().removed, 0);
    }

    /// A wall of 3 cm along x at y = 1 m, as 16 rings see it in part, from `x_m`.
    async fn pass_along_a_wall(service: &MapService, scan_id: u64, [x_m, y_m]: [f32; 2]) -> u64 {
        let point = |i: usize| {
            let (azimuth, elevation) = ((i / 16) as f32 * 0.4, (i % 16) as f32 * 2.0 - 15.0);
            let ((sin, cos), slope) = (azimuth.to_radians().sin_cos(), elevation.to_radians().tan());
            let r = (1.0 - y_m) / sin;
            (sin > 0.05 && r < 25.0).then(|| Point::new(r * cos, r * sin, r * slope))
        };
        let points: Vec<_> = (0..900 * 16).filter_map(point).collect();
        let scan = ScanRequest {
            scan_id: Some(scan_id),
            guess: Guess::Pose(Pose::translation(f64::from(x_m), f64::from(y_m), 0.0)),
            at_guess: true,
            ..ScanRequest::new(RobotName::new("r").unwrap(), points.into())
        };
        service.insert_scan(&map(), scan).await.unwrap().version.revision
    }

    #[tokio::test]
    async fn a_wall_that_stands_stays_though_later_scans_see_it_askew_and_in_part() {
        let data = TempDir::new().unwrap();
        let service = service(&data).await;
        let mut near = 0;
        for k in 0..12 {
            near = pass_along_a_wall(&service, k, [k as f32 * 0.4, 0.4]).await;
        }
        for k in 12..24 {
            pass_along_a_wall(&service, k, [(k - 12) as f32 * 0.4, -2.0]).await;
        }
        let region = Region::Box { min_m: [-30.0; 3], max_m: [30.0; 3] };
        let target = DeletionTarget::NotSeenSince(NotSeenSince { region, revision: near });
        let deletion = Deletion { target, level: 0, request_id: None };
        assert_eq!(service.delete_voxels(&map(), deletion).await.unwrap().removed, 0);
    }

    #[tokio::test]
    async fn a_revision_that_is_not_there_or_not_kept_is_refused() {
        let data = TempDir::new().unwrap();
        let service = service(&data).await;
        insert(&service, 1, 0.0, true).await;
        let error = service.delete_voxels(&map(), not_seen_since(9)).await.unwrap_err();
        assert_eq!(error.reason, Reason::BadRevision);
        assert!(error.to_string().contains("at most 1, got 9"), "{error}");
        let in_memory = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        in_memory.create_map(map(), MapSettings::new(0.1, 4)).await.unwrap();
        let error = in_memory.delete_voxels(&map(), not_seen_since(0)).await.unwrap_err();
        assert_eq!(error.reason, Reason::NoJournal);
    }
}
