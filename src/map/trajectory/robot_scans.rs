//! The scans of one robot.

use super::MappedScan;
use super::chunked::Chunked;
use super::id_ranges::IdRanges;
use super::thinning::Seen;

/// Where the poses of one robot are, and which of its ids are known.
#[derive(Debug, Clone, Default)]
pub(super) struct RobotScans {
    /// Revisions of the robot's accepted scans that are kept.
    pub(super) revisions: Chunked<u64>,
    /// Ids of these scans, with their revisions.
    ids: Chunked<(u64, u64)>,
    /// Ids of the robot's thinned scans.
    pub(super) forgotten: IdRanges,
    pub(super) seen: Seen,
}

impl RobotScans {
    pub(super) fn push(&mut self, pose: &MappedScan) {
        self.revisions.insert(pose.revision);
        if let Some(id) = pose.scan_id {
            self.ids.insert((id, pose.revision));
        }
    }

    /// The revision of the scan of that id.
    pub(super) fn find(&self, id: u64) -> Option<u64> {
        self.ids.get(id).map(|&(_, revision)| revision)
    }

    /// Takes these scans out, which ascend by revision; their ids.
    pub(super) fn remove<'p>(&mut self, poses: impl Iterator<Item = &'p MappedScan>) -> Vec<u64> {
        let (mut revisions, mut ids) = (Vec::new(), Vec::new());
        for pose in poses {
            revisions.push(pose.revision);
            ids.extend(pose.scan_id.filter(|&id| self.find(id) == Some(pose.revision)));
        }
        ids.sort_unstable();
        self.revisions.remove_all(&revisions);
        self.ids.remove_all(&ids);
        ids
    }

    /// The revisions before `before` that are to be judged, all but the last two of them, ascending.
    pub(super) fn unjudged(&self, before: u64) -> Vec<u64> {
        let unjudged = self.revisions.from(self.seen.judged.saturating_add(1));
        let mut revisions: Vec<u64> = unjudged.copied().take_while(|&revision| revision < before).collect();
        revisions.truncate(revisions.len().saturating_sub(2));
        revisions
    }

    /// True of a robot of whom nothing is known.
    pub(super) fn is_unknown(&self) -> bool {
        self.revisions.is_empty() && self.forgotten.as_slice().is_empty()
    }

    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.revisions.bytes()
            + self.ids.bytes()
            + self.forgotten.bytes()
            + self.seen.bytes()
    }
}
