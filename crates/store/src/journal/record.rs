//! Records: changes as bytes, encoded before their revision is known.

use prost::Message;

use crate::codec::Unreadable;
use crate::pb;
use mrol_map::map::Change;

/// Most bytes of a record before compression. No memory is taken beyond it: deleting a whole map of the largest default
/// size takes a tenth of it.
pub const RECORD_BYTES_MAX: usize = 2 << 30;
/// Compression level of zstd: the fastest, since gaps and octrees leave little to compress.
const ZSTD_LEVEL: i32 = 1;

/// A change, encoded (`proto/mrol/store/v1/records.proto`), compressed and checksummed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Record {
    /// The zstd frame of the change.
    pub(super) payload: Vec<u8>,
    /// Bytes before compression.
    pub(super) bytes: u32,
    /// CRC-32C of the payload.
    pub(super) checksum: u32,
}

impl Record {
    /// Encodes a change.
    ///
    /// # Errors
    /// When it is larger than [`RECORD_BYTES_MAX`], or there is no memory to compress it.
    pub fn of(change: &Change) -> Result<Self, String> {
        let message = pb::Change::from(change).encode_to_vec();
        if message.len() > RECORD_BYTES_MAX {
            return Err(format!("a record of {} bytes, at most {RECORD_BYTES_MAX} are kept", message.len()));
        }
        let payload = zstd::bulk::compress(&message, ZSTD_LEVEL).map_err(|e| e.to_string())?;
        let checksum = crc32c::crc32c(&payload);
        Ok(Self { payload, bytes: message.len() as u32, checksum })
    }

    /// Bytes of the payload: what the record takes in the journal, without its frame.
    pub fn len(&self) -> usize {
        self.payload.len()
    }

    /// CRC-32C of the payload: tells two records of one revision apart.
    pub fn checksum(&self) -> u32 {
        self.checksum
    }

    /// Returns false: a record has at least its kind.
    pub fn is_empty(&self) -> bool {
        self.payload.is_empty()
    }
}

/// The bytes of a record whose checksum was right.
pub(super) fn decompressed(payload: &[u8], bytes: u32) -> Result<Vec<u8>, Unreadable> {
    if bytes as usize > RECORD_BYTES_MAX {
        return Err(format!("a record of {bytes} bytes, at most {RECORD_BYTES_MAX} are read"));
    }
    zstd::bulk::decompress(payload, bytes as usize).map_err(|e| e.to_string())
}

/// Decodes the change of a record whose checksum was right.
pub(super) fn change_of(payload: &[u8], bytes: u32) -> Result<Change, Unreadable> {
    let message = decompressed(payload, bytes)?;
    pb::Change::decode(&message[..]).map_err(|e| e.to_string())?.try_into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::geometry::{Point, Pose};
    use mrol_map::map::{
        CallerName, DeletionRecord, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOutShape,
        MappedScan, Prism, Request, RequestId, RobotName, ScanRecord, UndoRecord, ViewpointRecord,
    };
    use mrol_map::visibility::{IMAGE_BYTES_MAX, RangeImage, Sweep};
    use mrol_map::voxel::{Lattice, MomentSet, VoxelKey, VoxelSet};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn voxels(n: i32) -> VoxelSet {
        (0..n).filter_map(|i| VoxelKey::new([i % 70 - 35, i / 70 - 40, i % 3])).collect()
    }

    /// None of those.
    fn other_voxels() -> VoxelSet {
        (0..30).filter_map(|i| VoxelKey::new([i, 0, 9])).collect()
    }

    fn image() -> RangeImage {
        let points: Vec<_> = (0..2000).map(|i| Point::new(2.0, (i % 50) as f32 / 20.0, 0.3)).collect();
        RangeImage::of_points(&points, Sweep::standing(9.0), IMAGE_BYTES_MAX).unwrap()
    }

    fn moments() -> MomentSet {
        MomentSet::of_centers(&voxels(500))
    }

    #[test]
    fn every_kind_of_change_survives_its_record() {
        let pose = MappedScan {
            scan_id: Some(7),
            timestamp_ns: Some(-5),
            level_overlaps: vec![0.1, 1.0 / 3.0],
            iterations: 12,
            points_skipped: 3,
            digest: u64::MAX,
            ..MappedScan::new(RobotName::new("r1").unwrap(), Pose::translation(0.1, -2.0, 1.0 / 3.0))
        };
        let request = Some(Request {
            id: RequestId::new("x-1").unwrap(),
            digest: 3,
            caller: Some(CallerName::new("r1").unwrap()),
        });
        let prism = Prism::new(&[[0.0, 0.1], [2.0, 0.0], [1.0, 3.0]], [-1.0, 1.0]).unwrap();
        let by = Some(CallerName::new("ops").unwrap());
        let (shape, made_by) = (KeepOutShape::Prism(prism), by.clone());
        let keep_out = |act| {
            let change = KeepOutChange { name: KeepOutName::new("dock").unwrap(), act };
            Change::KeepOut(KeepOutRecord { change, request: request.clone() })
        };
        for change in [
            keep_out(KeepOutAct::Put { shape, made_by, expires_at_ns: Some(i64::MIN) }),
            keep_out(KeepOutAct::Removed { by }),
            keep_out(KeepOutAct::Expired),
            Change::Insertion(ScanRecord {
                pose,
                voxels: voxels(5000),
                carved: other_voxels(),
                moments: moments(),
                viewpoint: Some(ViewpointRecord { image: image(), displaced: vec![2, 3, 900] }),
            }),
            Change::Deletion(DeletionRecord { voxels: voxels(10), request: None }),
            Change::Undo(UndoRecord {
                scans: vec![3, 9],
                deletions: vec![5],
                removed: voxels(20),
                restored: other_voxels(),
                moments: moments(),
                request: request.clone(),
            }),
        ] {
            let record = Record::of(&change).unwrap();
            assert_eq!(change_of(&record.payload, record.bytes).unwrap(), change);
        }
    }

    #[test]
    fn a_viewpoint_that_is_none_is_refused_with_what_is_wrong() {
        let viewpoint = Some(ViewpointRecord { image: image(), displaced: vec![3, 4] });
        let pose = MappedScan::new(RobotName::new("r1").unwrap(), Pose::identity());
        let scan = ScanRecord { viewpoint, ..ScanRecord::of_voxels(pose, voxels(9)) };
        let refused = |change: fn(&mut pb::ScanViewpoint)| {
            let mut message = pb::Insertion::from(&scan);
            change(message.viewpoint.as_mut().unwrap());
            ScanRecord::try_from(message).unwrap_err()
        };
        let cut = refused(|it| it.image = it.image.slice(..20));
        assert!(cut.starts_with("insertion.viewpoint: a range image of 20 bytes"), "{cut}");
        let large = refused(|it| it.image = vec![0; 8193].into());
        assert!(large.contains("of 8193 bytes, at most 8192"), "{large}");
        let twice = refused(|it| it.displaced_gaps = vec![3, 0]);
        assert!(twice.contains("displaced_gaps names 3 twice"), "{twice}");
    }

    #[test]
    fn a_scan_of_a_surface_takes_less_than_two_bits_a_voxel() {
        let surface =
            (0..300 * 300).filter_map(|i| VoxelKey::new([i % 300, i / 300, (i % 300 + i / 300) / 40]));
        let record =
            Record::of(&Change::Deletion(DeletionRecord { voxels: surface.collect(), request: None }))
                .unwrap();
        assert!(record.len() * 8 < 2 * 300 * 300, "{} bytes", record.len());
    }

    #[test]
    fn a_scan_of_points_far_from_each_other_takes_less_than_half_of_their_coordinates() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut along = || random.random_range(0.0..0.4f32);
        let points: Vec<_> = (0..100 * 100)
            .map(|i| Point::new((i % 100) as f32 * 0.4 + along(), (i / 100) as f32 * 0.4 + along(), along()))
            .collect();
        let lattice = Lattice::new(0.1, 4).unwrap();
        let pose = MappedScan::new(RobotName::new("r1").unwrap(), Pose::identity());
        let change = Change::Insertion(ScanRecord::of_points(pose, &points, &lattice));
        let record = Record::of(&change).unwrap();
        assert!(record.len() < points.len() * 12 / 2, "{} bytes", record.len());
        assert_eq!(change_of(&record.payload, record.bytes).unwrap(), change);
    }

    #[test]
    fn a_length_that_is_a_lie_is_an_error() {
        let record =
            Record::of(&Change::Deletion(DeletionRecord { voxels: voxels(9), request: None })).unwrap();
        assert!(change_of(&record.payload, record.bytes - 1).is_err());
        assert!(change_of(&record.payload, u32::MAX).unwrap_err().contains("at most"));
        assert!(change_of(b"garbage", 100).is_err());
    }
}
