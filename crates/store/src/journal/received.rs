//! Records on their way between nodes that share a map: in the frames of the journal, with its checks.

use uuid::Uuid;

use super::frame;
use super::mention::StoredRecord;
use super::record::Record;
use mrol_map::map::Change;

/// A record that another node sent, and what it says.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceivedRecord {
    /// The revision that it makes.
    pub revision: u64,
    /// As it is to be appended.
    pub record: Record,
    /// As it is to be applied.
    pub change: Change,
}

/// Frames of consecutive records, of which the first makes revision `first` of the map `map`.
pub fn frames_of(records: &[&Record], first: u64, map: Uuid) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(records.iter().map(|record| record.frame_bytes()).sum());
    for (revision, record) in (first..).zip(records) {
        // What is before the first is durable where these are sent from.
        frame::write(record, revision, first.saturating_sub(1), map, &mut bytes);
    }
    bytes
}

/// Reads frames of consecutive records of the map `map`, of which the first makes revision `first`.
///
/// # Errors
/// Says what is wrong with which of them: its checksums, its revision, or the change itself.
pub fn read_frames(bytes: &[u8], first: u64, map: Uuid) -> Result<Vec<ReceivedRecord>, String> {
    let (mut received, mut at) = (Vec::new(), 0);
    for revision in first.. {
        let of_revision = |reason: String| format!("the record of revision {revision}: {reason}");
        let Some(frame) = frame::read(bytes, at, map).map_err(|bad| of_revision(bad.reason))? else { break };
        if frame.revision != revision {
            return Err(of_revision(format!("it says that it makes revision {}", frame.revision)));
        }
        let change = frame.change().map_err(of_revision)?;
        received.push(ReceivedRecord { revision, record: frame.stored().into(), change });
        at += frame.len();
    }
    Ok(received)
}

impl Record {
    /// Bytes that it takes in the journal, its frame included.
    pub fn frame_bytes(&self) -> usize {
        frame::length_of(self.len())
    }
}

impl From<StoredRecord> for Record {
    fn from(StoredRecord { payload, bytes }: StoredRecord) -> Self {
        let checksum = crc32c::crc32c(&payload);
        Self { payload, bytes, checksum }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::DeletionRecord;
    use mrol_map::voxel::VoxelKey;

    const MAP: Uuid = Uuid::from_u128(7);

    fn deletion(n: i32) -> Change {
        let voxels = (0..n).filter_map(|x| VoxelKey::new([x, n, 0])).collect();
        Change::Deletion(DeletionRecord { voxels, request: None })
    }

    fn frames(first: u64) -> Vec<u8> {
        let records: Vec<_> = (1..4).map(|n| Record::of(&deletion(n)).unwrap()).collect();
        frames_of(&records.iter().collect::<Vec<_>>(), first, MAP)
    }

    #[test]
    fn records_arrive_as_they_were_sent() {
        let received = read_frames(&frames(5), 5, MAP).unwrap();
        assert_eq!(received.iter().map(|it| it.revision).collect::<Vec<_>>(), [5, 6, 7]);
        for (n, it) in (1..).zip(received) {
            assert_eq!((it.change.clone(), it.record), (deletion(n), Record::of(&it.change).unwrap()));
        }
        assert_eq!(read_frames(&[], 5, MAP), Ok(Vec::new()));
    }

    #[test]
    fn what_is_of_another_place_or_map_or_was_cut_is_refused() {
        let refused = |bytes: &[u8], first, map| read_frames(bytes, first, map).unwrap_err();
        let bytes = frames(5);
        assert!(refused(&bytes, 6, MAP).contains("of revision 6: it says that it makes revision 5"));
        assert!(refused(&bytes, 5, Uuid::from_u128(8)).contains("checksum"));
        assert!(refused(&bytes[..bytes.len() - 1], 5, MAP).contains("of revision 7"));
    }
}
