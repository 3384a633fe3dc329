//! What one revision did to a map: everything that doing it again needs, and nothing that would have to be computed
//! again in floating point.

use crate::map::keep_out::KeepOutChange;
use crate::map::name::{CallerName, RequestId};
use crate::map::trajectory::ScanRecord;
use crate::voxel::{MomentSet, VoxelSet};

/// One committed change. A map is what its changes made of it, in the order of revisions: the same changes make
/// the same map, bit for bit, on every machine.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// A scan went in.
    Insertion(ScanRecord),
    /// Voxels were taken out.
    Deletion(DeletionRecord),
    /// Scans and deletions were taken back.
    Undo(UndoRecord),
    /// A keep-out was put or ended.
    KeepOut(KeepOutRecord),
}

/// Voxels that were taken out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeletionRecord {
    /// The finest voxels, all of them there before.
    pub voxels: VoxelSet,
    /// Under which id it was asked for.
    pub request: Option<Request>,
}

/// Scans and deletions that were taken back.
///
/// The map after it is what replaying all other changes would give, with the deletions and what scans carved as they
/// were.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct UndoRecord {
    /// The revisions that the scans had made, ascending.
    pub scans: Vec<u64>,
    /// The revisions that the deletions had made, ascending.
    pub deletions: Vec<u64>,
    /// The finest voxels that go, all of them there before: no other scan holds them.
    pub removed: VoxelSet,
    /// The finest voxels that come back, none of them there before.
    pub restored: VoxelSet,
    /// What the moments of the voxels that the changes touched are without them, see
    /// [`Reversal::moments`](crate::map::Reversal::moments).
    pub moments: MomentSet,
    /// Under which id it was asked for.
    pub request: Option<Request>,
}

/// A keep-out that was put or ended.
#[derive(Debug, Clone, PartialEq)]
pub struct KeepOutRecord {
    /// What happened to which.
    pub change: KeepOutChange,
    /// Under which id it was asked for.
    pub request: Option<Request>,
}

/// The caller's own name of a change, by which it is told when it comes again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// Chosen by the caller.
    pub id: RequestId,
    /// A digest of what was asked for, so that the same request sent again is told from another under its id.
    pub digest: u64,
    /// The caller who asked for it; none without a key, and in what was written before this was noted.
    pub caller: Option<CallerName>,
}

impl Change {
    /// The sets of finest voxels that it touches: those that it takes out, brings, or shows again.
    pub fn touched(&self) -> Vec<&VoxelSet> {
        match self {
            Self::Insertion(scan) => vec![&scan.voxels, &scan.carved],
            Self::Deletion(deletion) => vec![&deletion.voxels],
            Self::Undo(undo) => vec![&undo.removed, &undo.restored],
            Self::KeepOut(_) => Vec::new(),
        }
    }

    /// Under which id it was asked for, where that is not a scan's.
    pub fn request(&self) -> Option<&Request> {
        match self {
            Self::Insertion(_) => None,
            Self::Deletion(deletion) => deletion.request.as_ref(),
            Self::Undo(undo) => undo.request.as_ref(),
            Self::KeepOut(keep_out) => keep_out.request.as_ref(),
        }
    }
}

impl UndoRecord {
    /// The revisions that all that was taken back had made: the scans' and the deletions'.
    pub fn changes(&self) -> impl Iterator<Item = u64> {
        self.scans.iter().chain(&self.deletions).copied()
    }
}
