//! Measurement of rays.

use super::stopwatch::Runs;
use crate::workload::Shots;
use mrol_map::map::MultiResolutionMap;
use mrol_map::planning::{RayError, RayHits, Rays, Toward, cast_rays};
use mrol_map::util::StopSignal;

/// Rays that were cast, and how long it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Cast {
    /// Duration of each pass over all rays, nanoseconds a ray.
    pub runs: Runs,
    /// What the rays hit.
    pub hits: RayHits,
}

/// Casts rays of `range_m` at `level` of `map` in `passes` passes, after one that is not timed.
///
/// # Errors
/// When the range is out of range.
pub fn cast(
    map: &MultiResolutionMap,
    shots: &Shots,
    range_m: f64,
    level: u32,
    passes: usize,
) -> Result<Cast, RayError> {
    let toward = Toward::Directions { directions: &shots.directions, range_m };
    let rays = Rays { origins: &shots.origins, toward };
    let cast = || cast_rays(&map.view(), &rays, level, StopSignal::NEVER);
    let (mut runs, hits) = (Runs::default(), cast()?);
    for _ in 0..passes {
        runs.time(rays.len(), cast)?;
    }
    Ok(Cast { runs, hits })
}

impl Cast {
    /// Mean distance of the rays that hit something, meters.
    pub fn mean_distance_m(&self) -> f64 {
        let met = self.hits.distances_m.iter().filter(|distance_m| distance_m.is_finite());
        met.map(|&distance_m| f64::from(distance_m)).sum::<f64>() / self.hits.hits().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Room, ShotLayout, Workload};
    use mrol_map::map::MapSettings;

    #[test]
    fn in_a_room_every_ray_meets_a_wall() {
        let room = Workload::Room(Room);
        let map = room.map(MapSettings::new(0.05, 4)).unwrap();
        let shots = room.shots(ShotLayout { places: 2, azimuths: 40, rings: 20 });
        let cast = cast(&map, &shots, 20.0, 0, 3).unwrap();
        assert_eq!((cast.hits.len(), cast.hits.hits(), cast.runs.ns_per_item().len()), (1600, 1600, 3));
        assert!((1.0..5.0).contains(&cast.mean_distance_m()), "{}", cast.mean_distance_m());
    }
}
