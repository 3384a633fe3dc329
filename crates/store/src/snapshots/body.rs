//! The body of a map file. Its contents are counted first, so that memory for each part is reserved before it is built.

use std::collections::HashSet;
use std::sync::Arc;

use prost::Message;
use uuid::Uuid;

use super::fields::{
    FIELDS_PER_STOP_CHECK, Fields, Value, bytes_of, count_bytes, count_varints, unzigzag, varints,
};
use super::limits::{MapFileError, MapFileLimits, Memory};
use super::snapshot::Snapshot;
use crate::codec::{Unreadable, moments, voxels, with_forgotten};
use crate::pb;
use mrol_map::bloom::FilterSettings;
use mrol_map::map::{
    CompletedRequest, IdempotencyLog, KEEP_OUTS_MAX, KeepOut, KeepOuts, MapContents, MapOrigin, MapSettings,
    MappedScan, REQUESTS_KEPT, Trajectory,
};
use mrol_map::util::StopSignal;
use mrol_map::voxel::{
    BLOCKS_PER_STOP_CHECK, BlockMask, MOMENT_LEVEL, MomentSet, Moments, VoxelKey, VoxelSet,
};

/// Field numbers, as in `proto/mrol/store/v1`.
pub(super) mod number {
    pub(in crate::snapshots) const UUID: u64 = 1;
    pub(in crate::snapshots) const RESOLUTION_M: u64 = 2;
    pub(in crate::snapshots) const LEVELS: u64 = 3;
    pub(in crate::snapshots) const FILTER_HASHES: u64 = 4;
    pub(in crate::snapshots) const FILTER_BITS_PER_KEY: u64 = 5;
    pub(in crate::snapshots) const REVISION: u64 = 6;
    pub(in crate::snapshots) const BLOCK_KEYS: u64 = 7;
    pub(in crate::snapshots) const BLOCK_MASKS: u64 = 8;
    pub(in crate::snapshots) const TRAJECTORY: u64 = 9;
    pub(in crate::snapshots) const VOXELS: u64 = 10;
    pub(in crate::snapshots) const WITHDRAWN: u64 = 11;
    pub(in crate::snapshots) const REQUESTS: u64 = 12;
    pub(in crate::snapshots) const MOMENTS: u64 = 13;
    pub(in crate::snapshots) const FORGOTTEN: u64 = 14;
    pub(in crate::snapshots) const KEEP_OUTS: u64 = 15;
    pub(in crate::snapshots) const NO_FILTER: u64 = 16;
    pub(in crate::snapshots) const NO_MOMENTS: u64 = 17;
    pub(in crate::snapshots) const VIEWPOINTS: u64 = 18;
    pub(in crate::snapshots) const ORIGIN: u64 = 19;
    pub(in crate::snapshots) const THINNED_SCANS: u64 = 20;

    /// Field of `Voxels` and of `Moments`.
    pub(in crate::snapshots) const KEY_GAPS: u64 = 1;
    /// Field of `Voxels`.
    pub(in crate::snapshots) const OCTREES: u64 = 2;
    /// Field of `Moments`.
    pub(in crate::snapshots) const NUMBERS: u64 = 2;
    pub(in crate::snapshots) const FORMS: u64 = 3;
    pub(in crate::snapshots) const POINTS: u64 = 4;

    /// Field of `ForgottenScans`.
    pub(in crate::snapshots) const ID_GAPS: u64 = 2;
}

/// Scans that are added to a trajectory between two checks of the stop signal: a few milliseconds.
const SCANS_PER_STOP_CHECK: usize = 4096;
/// Robots whose forgotten scans are read between two checks of the stop signal, each with up to some thousand ranges.
const ROBOTS_PER_STOP_CHECK: usize = 16;
/// Most bytes of one scan or request: a name, an overlap for each level and some numbers are a few hundred.
const RECORD_BYTES_MAX: usize = 4096;
/// Bytes of memory of a number that is read into a growing list: the old and the new allocation.
const NUMBER_BYTES: usize = 3 * size_of::<u64>();
/// Bytes of memory of a scan in the trajectory: the scan itself, read and in a growing list, its overlaps and name, and
/// its entries by robot and id.
const SCAN_BYTES: usize = 3 * size_of::<MappedScan>() + 12 * size_of::<f64>() + 240;
/// Bytes of memory of a request, which is indexed by its id, its revision and its caller, each with a string of its
/// own.
const REQUEST_BYTES: usize = 3 * size_of::<CompletedRequest>() + 320;
/// Most sessions of robots whose forgotten scans a file may list.
const SESSIONS_MAX: usize = 1 << 20;
/// Bytes of memory of a session with forgotten scans, without the ids: its name, the robot's, and their entries by
/// name.
const FORGOTTEN_BYTES: usize = 480;
const BLOCK_BYTES: usize = NUMBER_BYTES + size_of::<(VoxelKey, BlockMask)>();
/// Bytes of memory of a voxel's moments: its key twice, and the moments with and without their key.
const MOMENT_BYTES: usize =
    2 * size_of::<VoxelKey>() + size_of::<Moments>() + size_of::<(VoxelKey, Moments)>();

/// A body whose fields were located, but not decoded.
#[derive(Debug)]
pub(super) struct Body<'a> {
    all: &'a [u8],
    pub(super) stop: StopSignal<'a>,
    uuid: &'a [u8],
    settings: [f64; 2],
    levels: u32,
    hashes: u32,
    no_filter: bool,
    no_moments: bool,
    origin: Option<&'a [u8]>,
    revision: u64,
    block_keys: &'a [u8],
    block_masks: &'a [u8],
    voxels: Option<&'a [u8]>,
    moments: Option<&'a [u8]>,
    scans: usize,
    thinned: u64,
    withdrawn: usize,
    requests: usize,
    forgotten: Vec<&'a [u8]>,
    keep_outs: usize,
}

impl<'a> Body<'a> {
    /// Locates the fields of a body. Once stopped, this and everything read from it is meaningless.
    ///
    /// # Errors
    /// When it is not a message, or a part that may occur once occurs twice.
    pub(super) fn of(all: &'a [u8], stop: StopSignal<'a>) -> Result<Self, Unreadable> {
        let mut body = Self {
            all,
            stop,
            uuid: &[],
            settings: [0.0; 2],
            levels: 0,
            hashes: 0,
            no_filter: false,
            no_moments: false,
            origin: None,
            revision: 0,
            block_keys: &[],
            block_masks: &[],
            voxels: None,
            moments: None,
            scans: 0,
            thinned: 0,
            withdrawn: 0,
            requests: 0,
            forgotten: Vec::new(),
            keep_outs: 0,
        };
        for field in stop.paced(Fields::of(all), FIELDS_PER_STOP_CHECK) {
            body.take(field?)?;
        }
        Ok(body)
    }

    fn take(&mut self, field: (u64, Value<'a>)) -> Result<(), Unreadable> {
        use Value::{Bytes, Fixed64, Varint};
        let small = |value: u64, what: &str| {
            u32::try_from(value).map_err(|_| format!("{what} is too large: {value}"))
        };
        match field {
            (number::UUID, Bytes(uuid)) => self.uuid = uuid,
            (number::RESOLUTION_M, Fixed64(bits)) => self.settings[0] = f64::from_bits(bits),
            (number::LEVELS, Varint(levels)) => self.levels = small(levels, "levels")?,
            (number::FILTER_HASHES, Varint(hashes)) => self.hashes = small(hashes, "filter_hashes")?,
            (number::FILTER_BITS_PER_KEY, Fixed64(bits)) => self.settings[1] = f64::from_bits(bits),
            (number::NO_FILTER, Varint(is_so)) => self.no_filter = is_so != 0,
            (number::NO_MOMENTS, Varint(is_so)) => self.no_moments = is_so != 0,
            (number::REVISION, Varint(revision)) => self.revision = revision,
            (number::BLOCK_KEYS, Bytes(keys)) if self.block_keys.is_empty() => self.block_keys = keys,
            (number::BLOCK_MASKS, Bytes(masks)) if self.block_masks.is_empty() => self.block_masks = masks,
            (number::VOXELS, Bytes(voxels)) if self.voxels.is_none() => self.voxels = Some(voxels),
            (number::MOMENTS, Bytes(moments)) if self.moments.is_none() => self.moments = Some(moments),
            (number::TRAJECTORY, Bytes(_)) => self.scans += 1,
            (number::WITHDRAWN, Bytes(_)) => self.withdrawn += 1,
            (number::REQUESTS, Bytes(_)) => self.requests += 1,
            (number::FORGOTTEN, Bytes(_)) if self.forgotten.len() == SESSIONS_MAX => {
                return Err(format!("forgotten scans of more than {SESSIONS_MAX} sessions"));
            }
            (number::FORGOTTEN, Bytes(robot)) => self.forgotten.push(robot),
            (number::KEEP_OUTS, Bytes(_)) => self.keep_outs += 1,
            (number::VIEWPOINTS, Bytes(_)) => {}
            (number::ORIGIN, Bytes(origin)) if self.origin.is_none() => self.origin = Some(origin),
            (number::THINNED_SCANS, Varint(scans)) => self.thinned = scans,
            (known @ number::UUID..=number::THINNED_SCANS, _) => {
                return Err(format!("field {known} comes twice, or is of another kind"));
            }
            // A field of a newer version, which is reported where it matters.
            _ => {}
        }
        Ok(())
    }

    /// Decodes the body.
    ///
    /// # Errors
    /// When the body is damaged, holds more than `limits` allow, or `memory` is refused.
    pub(super) fn read<E>(
        self,
        limits: &MapFileLimits,
        memory: &mut Memory<impl FnMut(u64) -> Result<(), E>>,
    ) -> Result<Snapshot, MapFileError<E>> {
        let uuid = Uuid::from_slice(self.uuid).map_err(|e| format!("uuid: {e}"))?;
        let settings = self.settings()?;
        self.check_counts(limits)?;
        let voxels = self.voxels(limits, memory)?;
        let moments = self.moments(&voxels, memory)?;
        memory.reserve(self.scans * SCAN_BYTES + self.withdrawn * 16 + self.requests * REQUEST_BYTES)?;
        let contents = MapContents {
            revision: self.revision,
            voxels,
            moments,
            trajectory: self.trajectory(memory)?,
            requests: self.requests()?,
            keep_outs: Arc::new(self.keep_outs()?),
            viewpoints: Arc::new(self.viewpoints(limits, memory)?),
        };
        let contents = contents.checked().map_err(|e| e.to_string())?;
        Ok(Snapshot { uuid, settings, contents })
    }

    fn settings(&self) -> Result<MapSettings, Unreadable> {
        let [resolution_m, bits_per_key] = self.settings;
        let filter = FilterSettings { hashes: self.hashes, bits_per_key };
        let filter = (!self.no_filter).then_some(filter);
        let (levels, moments, origin) = (self.levels, !self.no_moments, self.origin()?);
        let settings = MapSettings { resolution_m, levels, filter, moments, origin };
        settings.checked().map_err(|e| e.to_string())
    }

    fn origin(&self) -> Result<Option<MapOrigin>, Unreadable> {
        let Some(bytes) = self.origin else { return Ok(None) };
        let pb::MapOrigin { position_m } =
            pb::MapOrigin::decode(bytes).map_err(|e| format!("origin: {e}"))?;
        let position_m = <[f64; 3]>::try_from(position_m)
            .map_err(|numbers| format!("origin: {} numbers, 3 are needed", numbers.len()))?;
        MapOrigin::new(position_m).map(Some).map_err(|e| e.to_string())
    }

    fn check_counts<E>(&self, limits: &MapFileLimits) -> Result<(), MapFileError<E>> {
        let (limit, most) = ("map_file_scans_max", limits.scans_max);
        for (what, count) in [("scans", self.scans), ("withdrawn changes", self.withdrawn)] {
            // Each made a revision of its own.
            if count as u64 > self.revision {
                return Err(MapFileError::Bad(format!(
                    "{count} {what} of a map at revision {}",
                    self.revision
                )));
            }
            if count > most {
                return Err(MapFileError::TooLarge { what, count, limit, most });
            }
        }
        if self.thinned.saturating_add(self.scans as u64) > self.revision {
            return Err(MapFileError::Bad(format!(
                "{} scans and {} without a pose of a map at revision {}",
                self.scans, self.thinned, self.revision
            )));
        }
        if self.requests > REQUESTS_KEPT {
            let message = format!("{} requests, a map remembers {REQUESTS_KEPT}", self.requests);
            return Err(MapFileError::Bad(message));
        }
        if self.keep_outs > KEEP_OUTS_MAX {
            let message = format!("{} keep-outs, a map has at most {KEEP_OUTS_MAX}", self.keep_outs);
            return Err(MapFileError::Bad(message));
        }
        Ok(())
    }

    fn voxels<E>(
        &self,
        limits: &MapFileLimits,
        memory: &mut Memory<impl FnMut(u64) -> Result<(), E>>,
    ) -> Result<VoxelSet, MapFileError<E>> {
        let within = |what, count| match count > limits.voxels_max {
            true => {
                let (limit, most) = ("voxels_per_map_max", limits.voxels_max);
                Err(MapFileError::TooLarge { what, count, limit, most })
            }
            false => Ok(()),
        };
        let of_version_1 = self.block_keys.len() / size_of::<u64>();
        let count_gaps = |voxels| count_varints(voxels, number::KEY_GAPS, self.stop);
        let blocks = self.voxels.map_or(Ok(of_version_1), count_gaps)?;
        // None of them is empty.
        within("blocks of voxels", blocks)?;
        // Decoding copies the octrees out of the body.
        let octrees = self.voxels.map_or(Ok(0), |voxels| count_bytes(voxels, number::OCTREES, self.stop))?;
        memory.reserve(blocks * BLOCK_BYTES + octrees)?;
        let voxels = match self.voxels {
            Some(message) => voxels::read(&self.voxels_message(message, blocks)?, self.stop)?,
            None => voxels_of_version_1(self.block_keys, self.block_masks, self.stop)?,
        };
        within("voxels", voxels.len())?;
        Ok(voxels)
    }

    fn moments<E>(
        &self,
        voxels: &VoxelSet,
        memory: &mut Memory<impl FnMut(u64) -> Result<(), E>>,
    ) -> Result<MomentSet, MapFileError<E>> {
        if self.no_moments {
            return Ok(MomentSet::default());
        }
        let beside = || voxels.blocks().iter().map(|(_, mask)| mask.count(MOMENT_LEVEL)).sum::<usize>();
        let Some(message) = self.moments else {
            memory.reserve(beside() * MOMENT_BYTES)?;
            return Ok(MomentSet::of_centers_until(voxels, self.stop));
        };
        let count = |field| count_varints(message, field, self.stop);
        let (gaps, numbers) = (count(number::KEY_GAPS)?, count(number::NUMBERS)?);
        let forms = count_bytes(message, number::FORMS, self.stop)?;
        let points = count_bytes(message, number::POINTS, self.stop)?;
        let keys = if gaps == 0 && forms > 0 { beside() } else { gaps };
        let copied = forms + points;
        memory.reserve((gaps + numbers) * NUMBER_BYTES + keys.max(forms) * MOMENT_BYTES + copied)?;
        let message = pb::Moments {
            key_gaps: varints(message, number::KEY_GAPS, gaps, |gap| gap, self.stop)?,
            numbers: varints(message, number::NUMBERS, numbers, unzigzag, self.stop)?,
            forms: bytes_of(message, number::FORMS, self.stop)?.to_vec().into(),
            points: bytes_of(message, number::POINTS, self.stop)?.to_vec().into(),
        };
        Ok(moments::read(&message, voxels, self.stop)?)
    }

    fn voxels_message(&self, message: &[u8], blocks: usize) -> Result<pb::Voxels, Unreadable> {
        Ok(pb::Voxels {
            key_gaps: varints(message, number::KEY_GAPS, blocks, |gap| gap, self.stop)?,
            octrees: bytes_of(message, number::OCTREES, self.stop)?.to_vec().into(),
        })
    }

    fn trajectory<E>(
        &self,
        memory: &mut Memory<impl FnMut(u64) -> Result<(), E>>,
    ) -> Result<Trajectory, MapFileError<E>> {
        let (scans, withdrawn) = (self.scans()?, self.withdrawn()?);
        if !scans.is_sorted_by(|one, next| one.revision < next.revision) {
            return Err("the revisions of its scans must ascend".to_owned().into());
        }
        let mut forgotten = Vec::with_capacity(self.forgotten.len());
        for robot in self.stop.paced(&self.forgotten, ROBOTS_PER_STOP_CHECK) {
            let ids = count_varints(robot, number::ID_GAPS, self.stop)?;
            memory.reserve(ids * NUMBER_BYTES + FORGOTTEN_BYTES)?;
            forgotten.push(decoded::<pb::ForgottenScans>(robot, "forgotten scans")?);
        }
        let trajectory = with_forgotten(Trajectory::default(), &forgotten, self.stop)?;
        let trajectory = trajectory.with_poses(self.stop.paced(scans, SCANS_PER_STOP_CHECK), withdrawn);
        Ok(trajectory.with_thinned(self.thinned))
    }

    fn scans(&self) -> Result<Vec<MappedScan>, Unreadable> {
        let mut scans = Vec::with_capacity(self.scans);
        for record in self.records(number::TRAJECTORY, RECORD_BYTES_MAX) {
            let scan: MappedScan = decoded::<pb::ScanPose>(record?, "a scan")?.try_into()?;
            scan.check_levels(self.levels).map_err(|e| e.to_string())?;
            scans.push(scan);
        }
        Ok(scans)
    }

    /// Decodes the requests: each has a revision of its own, and each id of a caller occurs once for each kind, since
    /// answers are found by them.
    fn requests(&self) -> Result<IdempotencyLog, Unreadable> {
        let requests: Vec<CompletedRequest> =
            self.records(number::REQUESTS, RECORD_BYTES_MAX).map(request).collect::<Result<_, _>>()?;
        let ascend = requests.is_sorted_by(|one, next| one.revision < next.revision);
        let ids: HashSet<_> =
            requests.iter().map(|request| (&request.caller, &request.id, request.kind)).collect();
        if !ascend || ids.len() != requests.len() {
            return Err("the revisions of its requests must ascend, and their ids must differ".into());
        }
        Ok(requests.into_iter().collect())
    }

    /// Decodes the keep-outs, of which no two have the same name.
    fn keep_outs(&self) -> Result<KeepOuts, Unreadable> {
        let keep_out =
            |record: Result<_, Unreadable>| decoded::<pb::KeepOut>(record?, "a keep-out")?.try_into();
        let keep_outs: Vec<KeepOut> =
            self.records(number::KEEP_OUTS, RECORD_BYTES_MAX).map(keep_out).collect::<Result<_, _>>()?;
        match keep_outs.is_sorted_by(|one, next| one.name < next.name) {
            true => Ok(keep_outs.into_iter().collect()),
            false => Err("the names of its keep-outs must ascend".into()),
        }
    }

    fn withdrawn(&self) -> Result<Vec<mrol_map::map::WithdrawnChange>, Unreadable> {
        let mut withdrawn = Vec::with_capacity(self.withdrawn);
        for record in self.records(number::WITHDRAWN, RECORD_BYTES_MAX) {
            withdrawn.push(decoded::<pb::WithdrawnChange>(record?, "a withdrawn change")?.into());
        }
        Ok(withdrawn)
    }

    /// The bytes of each of the messages of a repeated field, which have at most `most` bytes.
    pub(super) fn records(
        &self,
        number: u64,
        most: usize,
    ) -> impl Iterator<Item = Result<&'a [u8], Unreadable>> {
        let of_number = move |field: Result<_, Unreadable>| match field {
            Ok((n, Value::Bytes(record))) if n == number => Some(match record.len() > most {
                true => Err(format!("a record of {} bytes, at most {most} are one", record.len())),
                false => Ok(record),
            }),
            Ok(_) => None,
            Err(unreadable) => Some(Err(unreadable)),
        };
        self.stop.paced(Fields::of(self.all), FIELDS_PER_STOP_CHECK).filter_map(of_number)
    }
}

fn request(record: Result<&[u8], Unreadable>) -> Result<CompletedRequest, Unreadable> {
    decoded::<pb::CompletedRequest>(record?, "a request")?.try_into()
}

fn decoded<M: Message + Default>(bytes: &[u8], what: &str) -> Result<M, Unreadable> {
    M::decode(bytes).map_err(|e| format!("{what}: {e}"))
}

fn voxels_of_version_1(keys: &[u8], masks: &[u8], stop: StopSignal<'_>) -> Result<VoxelSet, Unreadable> {
    let ((keys, odd), (masks, rest)) = (keys.as_chunks(), masks.as_chunks::<{ BlockMask::BYTES }>());
    if masks.len() != keys.len() || !odd.is_empty() || !rest.is_empty() {
        return Err(format!(
            "{} block keys with {} bytes of masks",
            keys.len(),
            masks.len() * BlockMask::BYTES
        ));
    }
    let block = |(&key, mask): (&[u8; 8], &[u8; BlockMask::BYTES])| {
        let key = u64::from_le_bytes(key);
        let key = VoxelSet::block_key(key).ok_or_else(|| format!("block key {key:#x} is out of range"))?;
        Ok::<_, Unreadable>((key, BlockMask::from_le_bytes(mask)))
    };
    let mut blocks = Vec::with_capacity(keys.len());
    for key_and_mask in stop.paced(keys.iter().zip(masks), BLOCKS_PER_STOP_CHECK) {
        blocks.push(block(key_and_mask)?);
    }
    Ok(VoxelSet::of_blocks_until(blocks, stop))
}
