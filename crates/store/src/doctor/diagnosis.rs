//! Findings about a map.

use crate::error::StoreError;

/// Findings about a map.
#[derive(Debug, Default)]
pub struct Diagnosis {
    /// Revisions of the readable snapshots, ascending.
    pub snapshots: Vec<u64>,
    /// Number of segments of the journal.
    pub segments: usize,
    /// Number of changes in the segments.
    pub records: u64,
    /// The revision that the files give; none without a readable snapshot.
    pub revision: Option<u64>,
    /// The last revision that the snapshots know to have been acknowledged.
    pub acknowledged: u64,
    /// Number of finest voxels at that revision.
    pub voxels: usize,
    /// Number of viewpoints at that revision.
    pub viewpoints: usize,
    /// Bytes that a crash left unfinished, which the next start cuts off: nothing acknowledged is among them.
    pub torn_bytes: u64,
    /// Files that were set aside because they cannot be read. Damaged snapshots are removed together with the snapshots
    /// of their age; parts of a journal stay until somebody removes them.
    pub set_aside: Vec<AsideFile>,
    /// Files in the folder that are not part of a map: harmless, but somebody put them there.
    pub not_understood: Vec<String>,
    /// Problems, a sentence each.
    pub problems: Vec<String>,
}

impl Diagnosis {
    pub(super) fn of_problem(error: &StoreError) -> Self {
        Self { problems: vec![error.to_string()], ..Self::default() }
    }
}

/// A file that was set aside.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AsideFile {
    /// The file's name in the map's folder.
    pub name: String,
    /// The file's size, bytes.
    pub bytes: u64,
}
