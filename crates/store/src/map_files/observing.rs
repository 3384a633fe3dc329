//! Reads from a map's folder what the map would hold without some changes, for undo.

use super::facts::Pin;
use super::map_folder::MapFolder;
use super::snapshot_files::snapshot_name;
use crate::error::StoreError;
use crate::folder;
use crate::journal::Changes;
use crate::snapshots::{MapFileError, MapFileLimits, Snapshot};
use mrol_map::map::{Change, MapSettings, VoxelOwnership, WithdrawnChange};
use mrol_map::util::StopSignal;

/// Ownership of the voxels that some changes touched.
#[derive(Debug)]
pub struct Observed {
    /// Ownership up to `revision`.
    pub observations: VoxelOwnership,
    /// The last revision that was read.
    pub revision: u64,
    /// Keeps the snapshot and journal that it was read from.
    pub pin: Pin,
}

/// Why the ownership of voxels could not be read.
#[derive(Debug, thiserror::Error)]
pub enum NotObserved<E> {
    /// The journal does not reach back to the first of the changes.
    #[error("the journal does not reach back to the first of the changes")]
    OutsideUndoWindow,
    /// Reading was stopped: the caller cancelled it, or its time is up.
    #[error("it was stopped")]
    Stopped,
    /// The memory for it was refused.
    #[error("{0}")]
    NoMemory(E),
    /// A snapshot or the journal cannot be read.
    #[error(transparent)]
    Unreadable(#[from] StoreError),
}

impl MapFolder {
    /// Reads what the map of `settings` holds without `targets`, scans and deletions by revision, up to the present
    /// head of the journal. `reserve` is called with the bytes of each part before it is built, when all parts before
    /// it exist.
    ///
    /// The journal is read twice: for the voxels that the targets touched, so that nothing else need be remembered, and
    /// from the base on.
    ///
    /// # Errors
    /// When the journal does not reach back far enough, something cannot be read, `reserve` refuses, or `stop` is set.
    pub fn observations<E: std::fmt::Display>(
        &self,
        settings: &MapSettings,
        targets: &[u64],
        withdrawn: &[WithdrawnChange],
        mut reserve: impl FnMut(u64) -> Result<(), E>,
        stop: StopSignal<'_>,
    ) -> Result<Observed, NotObserved<E>> {
        let pin = self.facts.pin_base_of(targets, withdrawn).ok_or(NotObserved::OutsideUndoWindow)?;
        let mut observations = VoxelOwnership::of(targets.to_vec(), withdrawn, settings.moments);
        self.touch(&mut observations, &mut reserve, stop)?;
        let (revision, path) = (pin.snapshot, self.path.file(&snapshot_name(pin.snapshot)));
        let bytes = self.files.size(&path).map_err(StoreError::io(&path))?;
        reserve(bytes).map_err(NotObserved::NoMemory)?;
        let file = match folder::read_until(&*self.files, &path, stop) {
            Err(StoreError::Cancelled) => return Err(NotObserved::Stopped),
            file => file?,
        };
        // An undo takes viewpoints away, and brings none back: those before it do not matter.
        let base = Snapshot::decode_but_parts(&file, &MapFileLimits::OWN, &mut reserve, stop);
        let (base, _) = base.map_err(|refusal| match refusal {
            MapFileError::NoMemory(refusal) => NotObserved::NoMemory(refusal),
            MapFileError::Stopped => NotObserved::Stopped,
            refusal => NotObserved::Unreadable(StoreError::damaged(&path, refusal.to_string())),
        })?;
        if !observations.begin(&base.contents, stop) {
            return Err(NotObserved::Stopped);
        }
        drop((base, file));
        let mut observed = Observed { observations, revision, pin };
        self.observe(&mut observed, stop)?;
        if stop.is_stopped() { Err(NotObserved::Stopped) } else { Ok(observed) }
    }

    /// Reads the change that made `revision`; none where there is no such revision.
    ///
    /// # Errors
    /// When undo does not reach back to it, or the journal cannot be read.
    pub fn change_at<E>(
        &self,
        revision: u64,
        withdrawn: &[WithdrawnChange],
    ) -> Result<Option<Change>, NotObserved<E>> {
        let _pin = self.facts.pin_base_of(&[revision], withdrawn).ok_or(NotObserved::OutsideUndoWindow)?;
        let (segments, head) = self.facts.journal();
        let change = self.place.read_at(vec![revision], &segments, head).next().transpose()?;
        Ok(change.map(|(_, change)| change))
    }

    /// Reads the changes from `revision` on, up to the journal's present head; none where that revision is not kept any
    /// more. What is removed meanwhile is an error among them.
    pub fn changes_from(&self, revision: u64) -> Option<Changes> {
        let (segments, head) = self.facts.journal();
        let is_kept = segments.first().is_some_and(|tail| *tail <= revision);
        is_kept.then(|| self.place.read_from(revision, &segments, head))
    }

    /// Reads which voxels the changes to undo touched.
    fn touch<E>(
        &self,
        observations: &mut VoxelOwnership,
        reserve: &mut impl FnMut(u64) -> Result<(), E>,
        stop: StopSignal<'_>,
    ) -> Result<(), NotObserved<E>> {
        let (segments, head) = self.facts.journal();
        let targets = observations.targets().to_vec();
        for change in self.place.read_at(targets, &segments, head) {
            stop.give_way();
            if stop.is_stopped() {
                return Err(NotObserved::Stopped);
            }
            let (_, change) = change?;
            reserve(observations.bytes_of(&change) as u64).map_err(NotObserved::NoMemory)?;
            observations.touch(&change);
        }
        Ok(())
    }

    /// Brings `observed` up to date with the changes since its revision.
    ///
    /// # Errors
    /// When the journal cannot be read.
    pub fn observe(&self, observed: &mut Observed, stop: StopSignal<'_>) -> Result<(), StoreError> {
        let (segments, head) = self.facts.journal();
        let changes = self.place.read_from(observed.revision + 1, &segments, head);
        for change in changes.take_while(|_| !stop.is_stopped()) {
            stop.give_way();
            let (revision, change) = change?;
            observed.observations.observe(revision, &change);
            observed.revision = revision;
        }
        Ok(())
    }
}
