//! Maps as files, out of a server and into one.

use uuid::Uuid;

use super::hosted_map::HostedMap;
use super::room::Room;
use super::{ErrorCode, Limits, MapFile, ServiceError, check_not_stopped};
use crate::store::{Snapshot, body_bytes};
use crate::util::StopSignal;

impl HostedMap {
    /// The map as a file, at one revision.
    ///
    /// # Errors
    /// `ResourceExhausted` for one that [`from_file`] would refuse: a backup that cannot be restored is none.
    pub(super) fn to_file(
        &self,
        room: &Room,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<MapFile, ServiceError> {
        let _lent = room.lend(self.snapshot_bytes(), "a map file")?;
        let snapshot = Snapshot::of(&self.map, self.uuid);
        check_not_stopped(stop)?;
        let encoded = snapshot.encode();
        let bytes =
            encoded.map_err(|e| ServiceError::new(ErrorCode::Internal, "not_encoded", e.to_string()))?;
        let (size, most) = (body_bytes(&bytes).max(bytes.len() as u64), limits.map_file_bytes_max as u64);
        if size > most {
            let message = format!(
                "map {} takes {size} bytes as a map file, before compression, and map_file_bytes_max is {most}: raise \
                 limits.map_file_bytes_max here, and where the file is to be restored",
                self.name
            );
            return Err(ServiceError::new(ErrorCode::ResourceExhausted, "map_file_too_large", message));
        }
        Ok(MapFile { bytes: bytes.into(), state: self.state(snapshot.contents.revision) })
    }
}

/// What a file holds, as a map of its own.
pub(super) fn from_file(file: &[u8], limits: &Limits) -> Result<Snapshot, ServiceError> {
    let decoded = Snapshot::decode_within(file, limits.map_file_bytes_max as u64);
    let bad = |reason| ServiceError::invalid("bad_map_file", format!("map file: {reason}"));
    let snapshot = decoded.map_err(bad)?;
    let (voxels, most) = (snapshot.contents.voxels.len(), limits.voxels_per_map_max);
    if voxels > most {
        let message = format!("the map file has {voxels} voxels, voxels_per_map_max is {most}");
        return Err(ServiceError::new(ErrorCode::ResourceExhausted, "map_full", message));
    }
    Ok(Snapshot { uuid: Uuid::new_v4(), ..snapshot })
}
