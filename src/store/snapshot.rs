//! A whole map in one file.
//!
//! ```text
//! offset  bytes
//!      0  8      magic "MROL-MAP"
//!      8  4      format version, u32 little-endian: 3
//!     12  4      CRC-32C of the version, from version 3 on, and of everything from offset 16, u32 little-endian
//!     16  8      bytes of the body before compression, u64 little-endian
//!     24  rest   the body: a zstd frame of a protobuf message, proto/mrol/store/v1/snapshot.proto
//! ```

use std::path::Path;

use prost::Message;
use uuid::Uuid;

use super::codec::{Unreadable, moments, with_forgotten};
use super::{FileSystem, StoreError, folder, pb};
use crate::bloom::FilterSettings;
use crate::map::{AnsweredRequest, MapContents, MapSettings, MultiResolutionMap, Trajectory, TrajectoryPose};
use crate::voxel::{BlockMask, MomentSet, VoxelSet};

/// The version that this build writes; it reads this one and all before. Version 1 had the voxels as masks of 64
/// bytes, and neither withdrawn scans nor requests; up to version 2 moments had no forms.
pub const FORMAT_VERSION: u32 = 3;
const MAGIC: &[u8; 8] = b"MROL-MAP";
const HEADER_BYTES: usize = 24;
const VERSION: std::ops::Range<usize> = 8..12;
const CHECKED_FROM: usize = 16;
/// Bodies beyond this are refused before memory is taken: 4 billion voxels of a surface.
const BODY_BYTES_MAX: u64 = 8 << 30;
const ZSTD_LEVEL: i32 = 1;

/// A map at one revision.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// Of this incarnation of the map.
    pub uuid: Uuid,
    /// What it was made with.
    pub settings: MapSettings,
    /// What it holds.
    pub contents: MapContents,
}

impl Snapshot {
    /// Takes the picture of `map`, at one revision.
    pub fn of(map: &MultiResolutionMap, uuid: Uuid) -> Self {
        Self { uuid, settings: *map.settings(), contents: map.contents() }
    }

    /// The map again.
    ///
    /// # Errors
    /// When its settings are out of range.
    pub fn restore(self) -> Result<MultiResolutionMap, crate::map::MapSettingsError> {
        MultiResolutionMap::restore(self.settings, self.contents)
    }

    /// Writes it to `path`, beside the old file and renamed.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn write(&self, files: &dyn FileSystem, path: &Path) -> Result<(), StoreError> {
        let bytes = self.encode().map_err(StoreError::io(path))?;
        folder::replace(files, path, &bytes)
    }

    /// Reads the file at `path`.
    ///
    /// # Errors
    /// When it cannot be read, is no map, is damaged, or was written by a newer version.
    pub fn read(files: &dyn FileSystem, path: &Path) -> Result<Self, StoreError> {
        let bytes = files.read(path).map_err(StoreError::io(path))?;
        Self::decode(&bytes).map_err(|reason| StoreError::damaged(path, reason))
    }

    /// The file's bytes.
    ///
    /// # Errors
    /// When compression fails, for want of memory.
    pub fn encode(&self) -> std::io::Result<Vec<u8>> {
        let body = self.to_message().encode_to_vec();
        let mut bytes = Vec::with_capacity(HEADER_BYTES + body.len() / 2);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&FORMAT_VERSION.to_le_bytes());
        bytes.extend_from_slice(&[0; 4]);
        bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
        bytes.extend(zstd::bulk::compress(&body, ZSTD_LEVEL)?);
        let checksum = checksum(&bytes, FORMAT_VERSION);
        bytes[12..CHECKED_FROM].copy_from_slice(&checksum.to_le_bytes());
        Ok(bytes)
    }

    /// The inverse of [`Snapshot::encode`].
    ///
    /// # Errors
    /// What is wrong with the bytes, and where.
    pub fn decode(bytes: &[u8]) -> Result<Self, Unreadable> {
        Self::decode_within(bytes, BODY_BYTES_MAX)
    }

    /// The same, where nobody knows who made the bytes: a body of more than `body_bytes_max` is refused before memory
    /// is taken for it.
    ///
    /// # Errors
    /// As there.
    pub fn decode_within(bytes: &[u8], body_bytes_max: u64) -> Result<Self, Unreadable> {
        let header = bytes.get(..HEADER_BYTES).ok_or_else(|| {
            format!("{} bytes are too few for a map file's header of {HEADER_BYTES}", bytes.len())
        })?;
        if &header[..8] != MAGIC {
            return Err("not a map file: it does not begin with MROL-MAP".into());
        }
        let version = u32_at(header, 8);
        if version == 0 || version > FORMAT_VERSION {
            return Err(format!(
                "format version {version}, this build reads 1 to {FORMAT_VERSION}: use a newer one"
            ));
        }
        let (stored, computed) = (u32_at(header, 12), checksum(bytes, version));
        if stored != computed {
            return Err(format!(
                "checksum {computed:08x} from offset {CHECKED_FROM} on, {stored:08x} expected"
            ));
        }
        let length = u64::from(u32_at(header, 16)) | u64::from(u32_at(header, 20)) << 32;
        if length > body_bytes_max {
            return Err(format!("a body of {length} bytes, at most {body_bytes_max} are read"));
        }
        let body = zstd::bulk::decompress(&bytes[HEADER_BYTES..], length as usize)
            .map_err(|e| format!("the body from offset {HEADER_BYTES} on: {e}"))?;
        let message = pb::Snapshot::decode(&body[..]).map_err(|e| format!("the body: {e}"))?;
        Self::from_message(message)
    }

    fn to_message(&self) -> pb::Snapshot {
        let MapContents { revision, voxels, moments, trajectory, requests } = &self.contents;
        pb::Snapshot {
            uuid: self.uuid.as_bytes().to_vec().into(),
            resolution_m: self.settings.resolution_m,
            levels: self.settings.levels,
            filter_hashes: self.settings.filter.hashes,
            filter_bits_per_voxel: self.settings.filter.bits_per_key,
            revision: *revision,
            block_keys: Vec::new(),
            block_masks: Vec::new().into(),
            trajectory: trajectory.poses().map(Into::into).collect(),
            voxels: Some(voxels.into()),
            withdrawn: trajectory.withdrawn().iter().map(Into::into).collect(),
            requests: requests.iter().map(Into::into).collect(),
            moments: Some(moments::beside(voxels, moments)),
            forgotten: trajectory.forgotten().map(Into::into).collect(),
        }
    }

    fn from_message(message: pb::Snapshot) -> Result<Self, Unreadable> {
        let filter =
            FilterSettings { hashes: message.filter_hashes, bits_per_key: message.filter_bits_per_voxel };
        let settings = MapSettings { resolution_m: message.resolution_m, levels: message.levels, filter };
        let poses: Vec<TrajectoryPose> =
            message.trajectory.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?;
        if !poses.is_sorted_by(|one, next| one.revision < next.revision) {
            return Err("the revisions of its scans must ascend".into());
        }
        let withdrawn = message.withdrawn.into_iter().map(Into::into).collect();
        let trajectory = with_forgotten(Trajectory::new(poses, withdrawn), &message.forgotten)?;
        let requests = message.requests.into_iter().map(AnsweredRequest::try_from);
        let voxels = match message.voxels {
            Some(voxels) => voxels.try_into()?,
            None => voxels_of_version_1(&message.block_keys, &message.block_masks)?,
        };
        let contents = MapContents {
            revision: message.revision,
            moments: match message.moments {
                Some(moments) => moments::read(&moments, &voxels)?,
                None => MomentSet::of_centers(&voxels),
            },
            voxels,
            trajectory,
            requests: requests.collect::<Result<_, _>>()?,
        };
        let uuid = Uuid::from_slice(&message.uuid).map_err(|e| format!("uuid: {e}"))?;
        let contents = contents.checked().map_err(|e| e.to_string())?;
        Ok(Self { uuid, settings: settings.checked().map_err(|e| e.to_string())?, contents })
    }
}

fn voxels_of_version_1(keys: &[u64], masks: &[u8]) -> Result<VoxelSet, Unreadable> {
    let (masks, rest) = masks.as_chunks::<{ BlockMask::BYTES }>();
    if masks.len() != keys.len() || !rest.is_empty() {
        return Err(format!(
            "{} block keys with {} bytes of masks",
            keys.len(),
            masks.len() * BlockMask::BYTES
        ));
    }
    let block = |(&key, mask): (&u64, &[u8; BlockMask::BYTES])| {
        let key = VoxelSet::block_key(key).ok_or_else(|| format!("block key {key:#x} is out of range"))?;
        Ok((key, BlockMask::from_le_bytes(mask)))
    };
    keys.iter().zip(masks).map(block).collect()
}

fn checksum(bytes: &[u8], version: u32) -> u32 {
    let of_version = if version < 3 { 0 } else { crc32c::crc32c(&bytes[VERSION]) };
    crc32c::crc32c_append(of_version, &bytes[CHECKED_FROM..])
}

fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[offset + i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry;
    use crate::map::{RequestId, RobotName, WithdrawnScan};
    use crate::voxel::{Moments, VoxelKey};

    fn snapshot() -> Snapshot {
        let keys = (0..5000).map(|i| VoxelKey::new([i % 70 - 35, i / 70 - 40, i % 3]).unwrap());
        let pose = TrajectoryPose {
            robot: RobotName::new("r1").unwrap(),
            scan_id: Some(7),
            timestamp_ns: Some(-5),
            map_from_sensor: geometry::pose([1.0, -2.0, 0.5], [0.0, 0.6, 0.0, 0.8]).unwrap(),
            revision: 41,
            level_overlaps: vec![0.5, 0.75],
            iterations: 12,
            points_skipped: 3,
            new_voxels: 5000,
            digest: u64::MAX,
        };
        let mut moments = Moments::of_offset([3, -4, 5]);
        moments += Moments::of_offset([-2048, 2048, 0]);
        let id = RequestId::new("undo-1").unwrap();
        let request = AnsweredRequest { id, digest: 9, revision: 42, voxels: 0, scans: 1 };
        Snapshot {
            uuid: Uuid::from_bytes([7; 16]),
            settings: MapSettings::new(0.05, 4),
            contents: MapContents {
                revision: 42,
                moments: MomentSet::from_iter([(VoxelKey::new([1, -2, 0]).unwrap(), moments)]),
                voxels: keys.collect(),
                trajectory: Trajectory::new([pose], vec![WithdrawnScan { scan: 39, revision: 42 }])
                    .with_forgotten(&RobotName::new("r0").unwrap(), [(0, 6), (9, 9), (u64::MAX, u64::MAX)]),
                requests: [request].into_iter().collect(),
            },
        }
    }

    #[test]
    fn a_snapshot_survives_its_file() {
        let bytes = snapshot().encode().unwrap();
        assert_eq!(Snapshot::decode(&bytes).unwrap(), snapshot());
    }

    #[test]
    fn a_flipped_bit_anywhere_is_an_error() {
        let bytes = snapshot().encode().unwrap();
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(Snapshot::decode(&damaged).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        let bytes = snapshot().encode().unwrap();
        for length in 0..bytes.len() {
            assert!(Snapshot::decode(&bytes[..length]).is_err(), "cut at {length}");
        }
    }

    #[test]
    fn a_newer_version_is_refused_by_name() {
        let mut bytes = snapshot().encode().unwrap();
        bytes[8] = 4;
        assert!(Snapshot::decode(&bytes).unwrap_err().contains("format version 4"));
    }

    #[test]
    fn a_file_without_moments_is_restored_with_those_of_voxel_centres() {
        let mut message = snapshot().to_message();
        message.moments = None;
        let old = Snapshot::from_message(message).unwrap().contents;
        assert_eq!(old.moments, MomentSet::of_centers(&old.voxels));
        let points: i64 = old.moments.as_slice().iter().map(|(_, moments)| moments.count()).sum();
        assert_eq!(points, 5000);
    }

    #[test]
    fn a_restored_map_is_the_map() {
        let map = snapshot().restore().unwrap();
        assert_eq!(Snapshot::of(&map, snapshot().uuid), snapshot());
    }
}
