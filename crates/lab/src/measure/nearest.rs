//! Measurement of the search for the nearest voxel.

use super::stopwatch::Runs;
use mrol_map::map::MultiResolutionMap;
use mrol_map::planning::{NearestError, NearestRequest, NearestVoxels, find_nearest};
use mrol_map::util::StopSignal;

/// Voxels that were found, and how long it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Searched {
    /// Duration of each pass over all points, nanoseconds a point.
    pub runs: Runs,
    /// What was found.
    pub nearest: NearestVoxels,
}

/// Searches in `passes` passes over all points, after one that is not timed.
///
/// # Errors
/// When the radius is out of range.
pub fn search(
    map: &MultiResolutionMap,
    request: &NearestRequest<'_>,
    passes: usize,
) -> Result<Searched, NearestError> {
    let search = || find_nearest(&map.view(), request, StopSignal::NEVER);
    let (mut runs, nearest) = (Runs::default(), search()?);
    for _ in 0..passes {
        runs.time(request.points.len(), search)?;
    }
    Ok(Searched { runs, nearest })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Order, Room, Workload};
    use mrol_map::map::MapSettings;
    use mrol_map::planning::MeasuredTo;

    #[test]
    fn what_a_sensor_sees_has_a_voxel_near() {
        let room = Workload::Room(Room);
        let map = room.map(MapSettings::new(0.05, 4)).unwrap();
        let points = room.map_points(Order::Scan, 1000, 1);
        let request = NearestRequest { points: &points, level: 0, radius_m: 0.5, to: MeasuredTo::Centers };
        let searched = search(&map, &request, 2).unwrap();
        assert_eq!((searched.nearest.len(), searched.nearest.count()), (1000, 1000));
        assert_eq!(searched.runs.ns_per_item().len(), 2);
    }
}
