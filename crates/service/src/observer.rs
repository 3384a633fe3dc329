//! Observers of a service: they are told of each operation when it is over, for metrics and for the audit.

use std::fmt::Debug;
use std::time::Duration;

use super::error::ServiceError;
use super::request::{DeletionAnswer, KeepOutAnswer, MapVersion, ScanAnswer, UndoAnswer};
use mrol_map::align::Verdict;
use mrol_map::map::{CallerName, Lookup, MapName, RobotName, SessionName};
use mrol_map::mapping::Recovered;

/// Told of each operation of a service when it is over.
///
/// It is called on the task that answers the caller, so it must not block.
pub trait Observer: Debug + Send + Sync {
    /// An operation is over: answered, refused, or left by its caller.
    fn operation_ended(&self, ended: &Ended<'_>);
}

/// An operation that is over.
#[derive(Debug)]
pub struct Ended<'a> {
    /// Which operation.
    pub operation: &'static str,
    /// The name of the caller's key, where there is one.
    pub caller: Option<&'a CallerName>,
    /// The map that it was asked of; none of an operation on all maps.
    pub map: Option<&'a MapName>,
    /// What came of it.
    pub end: End<'a>,
}

/// How an operation ended.
#[derive(Debug)]
pub enum End<'a> {
    /// The operation was done.
    Done(Outcome),
    /// The operation was refused, or failed.
    Failed(&'a ServiceError),
    /// The caller went away first. A change that was decided on by then is made all the same.
    CallerGone,
    /// A change that removed voxels was made after its caller had gone, which was told of as [`End::CallerGone`].
    DoneUnheard(Change),
}

/// What an operation did.
#[derive(Debug)]
pub enum Outcome {
    /// The operation read, and nothing of it is counted.
    Read,
    /// Points were looked up.
    Points {
        /// How.
        lookup: Lookup,
        /// How many points.
        points: usize,
    },
    /// A scan was judged, and inserted where the verdict or its sender said so.
    Scan(JudgedScan),
    /// The map, or which maps there are, was changed.
    Changed(Change),
}

/// A scan that was judged for insertion.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedScan {
    /// The robot that sent the scan.
    pub robot: RobotName,
    /// The run of the robot's software that it is of.
    pub session: SessionName,
    /// The robot's own number of it.
    pub scan_id: Option<u64>,
    /// How it fits.
    pub verdict: Verdict,
    /// Why the map did not take it, in a sentence; none of a scan that it took.
    pub refusal: Option<String>,
    /// Fraction of its points in occupied voxels of level 0, before it was added.
    pub overlap: f64,
    /// Time that the alignment took.
    pub align_time: Duration,
    /// An answer that was given before.
    pub replayed: bool,
    /// How its robot, which was lost, was found again.
    pub recovered: Option<Recovered>,
    /// What it carved, where it took voxels out of the map.
    pub carved: Option<Change>,
}

/// What a change of a map did.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Change {
    /// The map's version before: another uuid where another map was replaced; none of a map that was not there.
    pub before: Option<MapVersion>,
    /// The map's version after it; none of a map that was deleted.
    pub after: Option<MapVersion>,
    /// Voxels of level 0 that were removed.
    pub voxels_removed: usize,
    /// Voxels of level 0 that were put back.
    pub voxels_restored: usize,
    /// Scans that were taken back.
    pub scans_undone: usize,
    /// Deletions that were taken back.
    pub deletions_undone: usize,
    /// True of a change that was done before under its request id, or had nothing to do.
    pub replayed: bool,
    /// The name that the map got, where it was renamed.
    pub renamed_to: Option<MapName>,
}

impl Change {
    /// A deletion that led to `after`.
    pub(super) fn of_deletion(&DeletionAnswer { version, removed, replayed }: &DeletionAnswer) -> Self {
        Self { voxels_removed: removed, ..Self::of_revision(version, !replayed && removed > 0) }
    }

    /// An undo that led to `after`.
    pub(super) fn of_undo(answer: &UndoAnswer) -> Self {
        let &UndoAnswer { scans, deletions, removed, restored, version, replayed } = answer;
        Self {
            voxels_removed: removed,
            voxels_restored: restored,
            scans_undone: scans,
            deletions_undone: deletions,
            ..Self::of_revision(version, !replayed && scans + deletions > 0)
        }
    }

    /// What a scan carved; none where it took nothing out, or was answered before.
    pub(super) fn of_carving(answer: &ScanAnswer) -> Option<Self> {
        let &ScanAnswer { carved_voxels, version, replayed, .. } = answer;
        (carved_voxels > 0 && !replayed).then(|| Self::of_removal(version, carved_voxels))
    }

    /// What removed so many voxels and led to `after`.
    pub(super) fn of_removal(after: MapVersion, voxels_removed: usize) -> Self {
        Self { voxels_removed, ..Self::of_revision(after, true) }
    }

    /// A keep-out that was put or removed.
    pub(super) fn of_keep_out(&KeepOutAnswer { version, replayed }: &KeepOutAnswer) -> Self {
        Self::of_revision(version, !replayed)
    }

    /// What led to `after`, by a revision of its own unless it was replayed or had nothing to do.
    fn of_revision(after: MapVersion, made_revision: bool) -> Self {
        let before =
            MapVersion { revision: after.revision - u64::from(made_revision), content_hash: None, ..after };
        Self { replayed: !made_revision, ..Self::of_map(Some(before), Some(after)) }
    }

    /// A map was renamed, which is at the version `at`.
    pub(super) fn of_renaming(to: MapName, at: MapVersion) -> Self {
        Self { before: Some(at), after: Some(at), renamed_to: Some(to), ..Self::default() }
    }

    /// A map was made, deleted or replaced.
    pub(super) fn of_map(before: Option<MapVersion>, after: Option<MapVersion>) -> Self {
        Self { before, after, replayed: before == after, ..Self::default() }
    }
}
