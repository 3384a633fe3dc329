//! A whole map in one file.
//!
//! ```text
//! offset  bytes
//!      0  8      magic "MROL-MAP"
//!      8  4      format version, u32 little-endian: 4
//!     12  4      CRC-32C of the version, from version 3 on, and of everything from offset 16, u32 little-endian
//!     16  8      bytes of the body before compression, u64 little-endian
//!     24  8      from version 4 on: head of the map's journal when the file was written, the last revision that may
//!                have been acknowledged, u64 little-endian
//!     32  16     from version 4 on: uuid of the map, as in the body
//!     48  rest   the body: a zstd frame of a protobuf message, proto/mrol/store/v1/snapshot.proto; from 24 on up to
//!                version 3
//! ```

mod body;
mod fields;
mod limits;

pub use limits::{MapFileError, MapFileLimits};

use std::convert::Infallible;
use std::path::Path;

use prost::Message;
use uuid::Uuid;

use super::codec::{Unreadable, moments};
use super::{FileSystem, StoreError, folder, pb};
use crate::map::{MapContents, MapSettings, MultiResolutionMap};
use body::Body;
use limits::Memory;

/// The version that this build writes; it reads this one and all before. Version 1 had the voxels as masks of 64
/// bytes, and neither withdrawn scans nor requests; up to version 2 moments had no forms, up to version 3 a header neither
/// head nor uuid.
pub const FORMAT_VERSION: u32 = 4;
const MAGIC: &[u8; 8] = b"MROL-MAP";
pub(super) const HEADER_BYTES: usize = 48;
/// Up to version 3.
const OLD_HEADER_BYTES: usize = 24;
const BODY_BYTES_AT: usize = 16;
const HEAD_AT: usize = 24;
const UUID_AT: usize = 32;
const VERSION: std::ops::Range<usize> = 8..12;
const CHECKED_FROM: usize = 16;
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
        bytes.extend_from_slice(&self.contents.revision.to_le_bytes());
        bytes.extend_from_slice(self.uuid.as_bytes());
        bytes.extend(zstd::bulk::compress(&body, ZSTD_LEVEL)?);
        set_checksum(&mut bytes);
        Ok(bytes)
    }

    /// The inverse of [`Snapshot::encode`], of a file of one's own.
    ///
    /// # Errors
    /// What is wrong with the bytes, and where.
    pub fn decode(bytes: &[u8]) -> Result<Self, Unreadable> {
        let decoded = Self::decode_within(bytes, &MapFileLimits::OWN, |_| Ok::<_, Infallible>(()));
        decoded.map_err(|refusal| refusal.to_string())
    }

    /// Reads a file of which nobody knows who made it. `reserve` is asked for the bytes of each part before it is built:
    /// what was asked for before is there by then.
    ///
    /// # Errors
    /// When something is wrong with the bytes, they hold more than `limits` allow, or `reserve` refuses.
    pub fn decode_within<E>(
        bytes: &[u8],
        limits: &MapFileLimits,
        reserve: impl FnMut(u64) -> Result<(), E>,
    ) -> Result<Self, MapFileError<E>> {
        let mut memory = Memory(reserve);
        let (compressed, length) = Self::checked_frame(bytes)?;
        let most = limits.body_bytes_max;
        if length > most {
            return Err(format!("a body of {length} bytes, at most {most} are read").into());
        }
        // A frame of less would be of less than its header says, and is refused all the same.
        memory.reserve(length as usize)?;
        let body = zstd::bulk::decompress(compressed, length as usize)
            .map_err(|e| format!("the body from offset {} on: {e}", bytes.len() - compressed.len()))?;
        Body::of(&body).map_err(|e| format!("the body: {e}"))?.read(limits, &mut memory)
    }

    /// The compressed body of a file whose header is right, and the bytes that it says it is of.
    fn checked_frame(bytes: &[u8]) -> Result<(&[u8], u64), Unreadable> {
        let header = bytes.get(..OLD_HEADER_BYTES).ok_or_else(|| too_short(bytes))?;
        if &header[..8] != MAGIC {
            return Err("not a map file: it does not begin with MROL-MAP".into());
        }
        let version = u32_at(header, 8);
        if version == 0 || version > FORMAT_VERSION {
            return Err(format!(
                "format version {version}, this build reads 1 to {FORMAT_VERSION}: use a newer one"
            ));
        }
        let header_bytes = if version < 4 { OLD_HEADER_BYTES } else { HEADER_BYTES };
        let compressed = bytes.get(header_bytes..).ok_or_else(|| too_short(bytes))?;
        let (stored, computed) = (u32_at(header, 12), checksum(bytes, version));
        if stored != computed {
            return Err(format!(
                "checksum {computed:08x} from offset {CHECKED_FROM} on, {stored:08x} expected"
            ));
        }
        Ok((compressed, u64_at(header, BODY_BYTES_AT)))
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
}

fn too_short(bytes: &[u8]) -> Unreadable {
    format!("{} bytes are too few for a map file's header", bytes.len())
}

/// The head of the journal that the map file `bytes`, which is whole, was written beside; none up to version 3.
pub(super) fn head_of(bytes: &[u8]) -> Option<u64> {
    let header = bytes.get(..HEADER_BYTES).filter(|header| u32_at(header, VERSION.start) >= 4)?;
    Some(u64_at(header, HEAD_AT))
}

/// Writes the head of the journal into the map file `bytes`.
pub(super) fn set_head(bytes: &mut [u8], head: u64) {
    bytes[HEAD_AT..UUID_AT].copy_from_slice(&head.to_le_bytes());
    set_checksum(bytes);
}

/// The uuid in the header of a map file, which may be damaged; none up to version 3.
pub(super) fn uuid_in(header: &[u8]) -> Option<Uuid> {
    let header = header.get(..HEADER_BYTES).filter(|header| u32_at(header, VERSION.start) >= 4)?;
    Uuid::from_slice(&header[UUID_AT..]).ok()
}

/// Bytes of the body of the map file `bytes` before compression.
pub(crate) fn body_bytes(bytes: &[u8]) -> u64 {
    bytes.get(..OLD_HEADER_BYTES).map_or(0, |header| u64_at(header, BODY_BYTES_AT))
}

fn set_checksum(bytes: &mut [u8]) {
    let checksum = checksum(bytes, FORMAT_VERSION);
    bytes[12..CHECKED_FROM].copy_from_slice(&checksum.to_le_bytes());
}

fn u64_at(bytes: &[u8], offset: usize) -> u64 {
    u64::from(u32_at(bytes, offset)) | u64::from(u32_at(bytes, offset + 4)) << 32
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
    use crate::map::{
        AnsweredRequest, CallerName, RequestId, RobotName, Trajectory, TrajectoryPose, WithdrawnScan,
    };
    use crate::voxel::{MomentSet, Moments, VoxelKey};

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
        let caller = Some(CallerName::new("r1").unwrap());
        let request = AnsweredRequest { id, digest: 9, caller, revision: 42, voxels: 0, scans: 1 };
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
    fn a_snapshot_says_whose_it_is_and_where_the_journal_was() {
        let mut bytes = snapshot().encode().unwrap();
        assert_eq!((head_of(&bytes), uuid_in(&bytes)), (Some(42), Some(snapshot().uuid)));
        set_head(&mut bytes, 45);
        assert_eq!(head_of(&bytes), Some(45));
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
        bytes[8] = 5;
        assert!(Snapshot::decode(&bytes).unwrap_err().contains("format version 5"));
    }

    #[test]
    fn a_file_without_moments_is_restored_with_those_of_voxel_centres() {
        let mut message = snapshot().to_message();
        message.moments = None;
        let body = message.encode_to_vec();
        let memory = &mut Memory(|_| Ok::<_, Infallible>(()));
        let old = Body::of(&body).unwrap().read(&MapFileLimits::OWN, memory).unwrap().contents;
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
