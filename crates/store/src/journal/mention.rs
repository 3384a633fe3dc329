//! What a record says of one voxel, found out without making sets of voxels of it.
//!
//! A search for the scans that touched a voxel reads many records. A set of voxels that lie far apart takes some forty
//! times the bytes of its record.

use prost::Message;

use super::record;
use crate::codec::{Unreadable, blocks_of, required};
use crate::pb;
use mrol_map::map::MappedScan;
use mrol_map::voxel::{VoxelKey, VoxelSet};

/// Most bytes that reading a record takes, for each of its bytes: the message, and its fields.
const MEMORY_PER_BYTE: u64 = 10;

/// A record as the journal holds it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredRecord {
    /// The zstd frame of the change.
    pub(super) payload: Vec<u8>,
    /// Bytes before compression.
    pub(super) bytes: u32,
}

/// What a record says of a voxel.
#[derive(Debug, Clone, PartialEq)]
pub enum VoxelMention {
    /// This scan touched it.
    Touched(Box<MappedScan>),
    /// The changes of these revisions were taken back, whether or not they touched it.
    Undone(Vec<u64>),
    /// Nothing.
    Nothing,
}

impl StoredRecord {
    /// Most bytes of memory that [`StoredRecord::mention`] takes.
    pub fn memory_bytes(&self) -> u64 {
        u64::from(self.bytes) * MEMORY_PER_BYTE
    }

    /// What the record says of `voxel` of `level`.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn mention(&self, voxel: VoxelKey, level: u32) -> Result<VoxelMention, String> {
        use pb::change::Kind;
        let message = record::decompressed(&self.payload, self.bytes)?;
        let change = pb::Change::decode(&message[..]).map_err(|e| e.to_string())?;
        match required(change.kind, "the change's kind, or known to this version,")? {
            Kind::Insertion(scan) => mention_of(scan, voxel, level),
            Kind::Undo(undo) => Ok(VoxelMention::Undone([undo.scans, undo.deletions].concat())),
            Kind::Deletion(_) | Kind::KeepOut(_) => Ok(VoxelMention::Nothing),
        }
    }
}

fn mention_of(scan: pb::Insertion, voxel: VoxelKey, level: u32) -> Result<VoxelMention, Unreadable> {
    let voxels = required(scan.voxels, "insertion.voxels")?;
    for block in blocks_of(&voxels) {
        if VoxelSet::block_touches(&block?, voxel, level) {
            let pose = required(scan.pose, "insertion.pose")?;
            return Ok(VoxelMention::Touched(Box::new(pose.try_into()?)));
        }
    }
    Ok(VoxelMention::Nothing)
}
