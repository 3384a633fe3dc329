//! Maps as files, out of a server and into one.

use uuid::Uuid;

use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::maps::{BuiltMap, HostedMap, snapshot_bytes};
use crate::request::MapFile;
use crate::resources::{ResourceBudget, growth_bytes};
use crate::work::ended_early;
use mrol_map::map::MultiResolutionMap;
use mrol_map::util::StopSignal;
use mrol_store::{MapFileError, MapFileLimits, Snapshot, body_bytes};

impl HostedMap {
    /// The map as a file, at one revision.
    ///
    /// # Errors
    /// `ResourceExhausted` for one that [`from_file`] would refuse: a backup that cannot be restored is none.
    pub(crate) fn to_file(
        &self,
        budget: &ResourceBudget,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<MapFile, ServiceError> {
        let _reserved = budget.reserve_transient(snapshot_bytes(&self.map), "a map file")?;
        let ended = || ended_early(stop);
        let snapshot = Snapshot::of_until(&self.map, self.uuid, stop).ok_or_else(ended)?;
        let encoded = snapshot.encode_until(stop);
        let encoded = encoded.map_err(|e| ServiceError::new(Reason::NotEncoded, e.to_string()))?;
        let bytes = encoded.ok_or_else(ended)?;
        let (size, most) = (body_bytes(&bytes).max(bytes.len() as u64), limits.map_file_bytes_max as u64);
        if size > most {
            let message = format!(
                "map {} takes {size} bytes as a map file, before compression, and map_file_bytes_max is {most}: raise \
                 limits.map_file_bytes_max here, and where the file is to be restored",
                self.name
            );
            return Err(ServiceError::new(Reason::MapFileTooLarge, message));
        }
        Ok(MapFile { bytes: bytes.into(), version: self.version(snapshot.contents.version()) })
    }
}

/// What a file holds, as a map of its own. Memory is reserved for each part before it is built, so that a file which is
/// small and becomes much is refused and not built.
pub(crate) fn from_file(
    file: &[u8],
    limits: &Limits,
    budget: &ResourceBudget,
    stop: StopSignal<'_>,
) -> Result<BuiltMap, ServiceError> {
    let bounds = MapFileLimits {
        body_bytes_max: limits.map_file_bytes_max as u64,
        voxels_max: limits.voxels_per_map_max,
        scans_max: limits.map_file_scans_max,
        viewpoint_bytes_max: limits.viewpoint_bytes_max,
    };
    // What was reserved before lies in memory by the time more is asked for, and is measured there.
    let mut part = None;
    let mut reserve = |bytes| {
        drop(part.take());
        part = Some(budget.reserve(bytes)?);
        Ok(())
    };
    let decoded = Snapshot::decode_until(file, &bounds, &mut reserve, stop);
    let Snapshot { settings, contents, .. } = decoded.map_err(|refusal| not_read(refusal, stop))?;
    let (robots, most) = (contents.trajectory.robots_with_scans(), limits.robots_per_map_max);
    if robots > most {
        let message = format!("the map file has scans of {robots} robots, robots_per_map_max is {most}");
        return Err(ServiceError::new(Reason::MapFull, message));
    }
    let moments = contents.moments.as_slice().len();
    reserve(settings.first_filter_bytes() + growth_bytes(&settings, &contents.voxels, moments))?;
    let map =
        MultiResolutionMap::restore_until(settings, contents, stop)?.ok_or_else(|| ended_early(stop))?;
    drop(part.take());
    let saving = budget.reserve(snapshot_bytes(&map))?;
    Ok(BuiltMap { uuid: Uuid::new_v4(), map, saving })
}

fn not_read(refusal: MapFileError<ServiceError>, stop: StopSignal<'_>) -> ServiceError {
    match refusal {
        MapFileError::NoMemory(refusal) => refusal,
        MapFileError::Stopped => ended_early(stop),
        MapFileError::Bad(reason) => ServiceError::new(Reason::BadMapFile, format!("map file: {reason}")),
        MapFileError::TooLarge { .. } => ServiceError::new(Reason::MapFull, refusal.to_string()),
    }
}
