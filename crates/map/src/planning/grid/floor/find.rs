//! Finding the floor: below each pose, and from there on.

use std::collections::HashSet;
use std::sync::Arc;

use super::height::Floor;
use super::regions::{Region, Regions, SQUARE_M, SQUARES_MIN};
use super::surfaces::Surfaces;
use crate::geometry::translation_m;
use crate::map::{MultiResolutionMap, PausingView};
use crate::planning::grid::request::{BandFrom, GridError, GridRequest};
use crate::util::StopSignal;

/// How far from below a pose the floor is looked for, meters. A spinning lidar on the roof of a car first meets the
/// road some 4 m away, one on a robot the floor at 1 to 3 m.
const SEARCHED_M: f64 = 5.0;
/// Most columns that these are: of voxels below 4 cm.
const SEARCHED_MAX: i32 = 128;
/// Storeys lie at least so far above each other, meters: what lies lower above a larger floor stands on that.
const STOREY_MIN_M: f64 = 2.0;
/// Side of squares by which it is told whether a floor is near, meters: what stands on a floor hides less of it.
const NEAR_M: f64 = 2.0;

/// The floor that the band of a request counts from; none where it counts from the map's z = 0 or has no bounds.
///
/// It is found below the viewpoints of the map, or in a map without any below the poses of its trajectory: there the
/// surface of the nearest column counts that is highest below the pose, where a region of 4 m² at least spreads from
/// it, or a larger one less than a storey below. So a desk below a sensor is no floor, nor is what it sees of its robot
/// if the floor below was seen. Where robots were on two floors above each other, the one counts on which they were in
/// more places, and the other one only away from it.
///
/// Reads all voxels of the level and takes some 70 bytes a surface meanwhile. Others go first between its parts. Once
/// stopped, the floor lacks parts.
///
/// # Errors
/// Where there is no such pose, or no floor below any.
pub fn find_floor(
    view: &mut PausingView<'_>,
    request: &GridRequest,
    stop: StopSignal<'_>,
) -> Result<Option<Arc<Floor>>, GridError> {
    let is_bounded = request.band_m.iter().any(|c| c.is_finite());
    if request.band_from == BandFrom::Map || !is_bounded {
        return Ok(None);
    }
    let places_m = places_m(view.view().map());
    if places_m.is_empty() {
        return Err(GridError::NoPoses);
    }
    let surfaces = Surfaces::of(view, request.level, stop);
    let voxel_m = view.lattice().resolution_m(request.level);
    // What is left to do reads the surfaces alone, and may take until the time is up.
    let mut floors = view.let_go_during(|| visited(&places_m, voxel_m, &surfaces, stop));
    if floors.is_empty() && !stop.is_stopped() {
        return Err(GridError::NoFloor { places: places_m.len() });
    }
    floors.sort_by_key(|region| std::cmp::Reverse(region.visits));
    let tops = apart(&floors, &surfaces, voxel_m);
    let view = view.view();
    let columns = tops
        .into_iter()
        .map(|surface| (surfaces.voxel(surface), surfaces.foot(view, request.level, surface)));
    Ok(Some(Arc::new(Floor::of(voxel_m, columns, stop))))
}

/// Where sensors were (map frame, meters), one place of each cube of half a meter: a robot that stands still counts
/// once.
fn places_m(map: &MultiResolutionMap) -> Vec<[f64; 3]> {
    let mut known = HashSet::new();
    let is_new = |place_m: &[f64; 3]| known.insert(place_m.map(|c| (c / SQUARE_M).floor() as i64));
    let viewpoints = map.viewpoints();
    if !viewpoints.is_empty() {
        let poses = viewpoints.iter().map(|(_, viewpoint)| translation_m(viewpoint.map_from_sensor()));
        return poses.filter(is_new).collect();
    }
    map.trajectory().poses().map(|scan| translation_m(&scan.map_from_sensor)).filter(is_new).collect()
}

/// The regions of which some are below places, each with how many.
fn visited(places_m: &[[f64; 3]], voxel_m: f64, surfaces: &Surfaces, stop: StopSignal<'_>) -> Vec<Region> {
    let mut pause = || {
        if stop.is_way_due() {
            stop.give_way();
        }
        !stop.is_stopped()
    };
    let mut regions = Regions::new(surfaces, voxel_m);
    for place_m in places_m {
        if !pause() || regions.is_ended {
            break;
        }
        visit(*place_m, voxel_m, surfaces, &mut regions, &mut pause);
    }
    let mut floors = regions.all;
    floors.retain(|region| region.visits > 0);
    floors
}

/// Notes the floor below a place.
fn visit(
    place_m: [f64; 3],
    voxel_m: f64,
    surfaces: &Surfaces,
    regions: &mut Regions<'_>,
    pause: &mut impl FnMut() -> bool,
) {
    let [x, y, z] = place_m.map(|c| (c / voxel_m).floor() as i32);
    let searched = ((SEARCHED_M / voxel_m).ceil() as i32).clamp(1, SEARCHED_MAX);
    for column in (0..=searched).flat_map(|distance| ring([x, y], distance)) {
        if let Some(region) = floor_of_column(column, z, voxel_m, surfaces, regions, pause) {
            regions.all[region].visits += 1;
            return;
        }
        if regions.is_ended {
            return;
        }
    }
}

/// The region of the floor in a column, below the voxel `z`: the highest that is one. Less than a storey below it the
/// larger one counts: what a driving robot sees of itself, and tables in a row, have more than 4 m², too.
fn floor_of_column(
    column: [i32; 2],
    z: i32,
    voxel_m: f64,
    surfaces: &Surfaces,
    regions: &mut Regions<'_>,
    pause: &mut impl FnMut() -> bool,
) -> Option<usize> {
    let below = surfaces.of_column(column).take_while(|surface| surfaces.voxel(*surface)[2] < z);
    let mut found: Option<(usize, i32)> = None;
    for surface in below.collect::<Vec<_>>().into_iter().rev() {
        let level = surfaces.voxel(surface)[2];
        if found.is_some_and(|(_, above)| f64::from(above - level) * voxel_m >= STOREY_MIN_M) {
            break;
        }
        let region = regions.region_of(surface, pause);
        if regions.is_ended {
            return None;
        }
        let size = |region: usize| regions.all[region].surfaces.len();
        if regions.all[region].is_floor() && found.is_none_or(|(other, _)| size(region) > size(other)) {
            found = Some((region, found.map_or(level, |(_, highest)| highest)));
        }
    }
    found.map(|(region, _)| region)
}

/// The surfaces of floors, those first that were visited most. Of a floor that lies above or below one before it, only
/// what is far from that: where something stands on a floor or hides it, a storey above is not the floor.
fn apart(floors: &[Region], surfaces: &Surfaces, voxel_m: f64) -> Vec<u32> {
    let square = |column: [i32; 2]| column.map(|i| (f64::from(i) * voxel_m / NEAR_M).floor() as i64);
    let (mut kept, mut columns, mut squares) = (Vec::new(), HashSet::new(), HashSet::new());
    for region in floors {
        let of_region = || region.surfaces.iter().map(|surface| (*surface, surfaces.column_of(*surface)));
        let shared = of_region().filter(|(_, column)| columns.contains(column)).count();
        let is_other_storey = shared as f64 * voxel_m * voxel_m >= SQUARES_MIN as f64 * SQUARE_M * SQUARE_M;
        let is_near = |column: [i32; 2]| {
            let [x, y] = square(column);
            (-1..=1).any(|dy| (-1..=1).any(|dx| squares.contains(&[x + dx, y + dy])))
        };
        let new: Vec<_> = of_region()
            .filter(|(_, column)| !(columns.contains(column) || is_other_storey && is_near(*column)))
            .collect();
        columns.extend(new.iter().map(|(_, column)| *column));
        squares.extend(new.iter().map(|(_, column)| square(*column)));
        kept.extend(new.into_iter().map(|(surface, _)| surface));
    }
    kept
}

/// The columns on the border of the square that reaches so far from a column.
fn ring([x, y]: [i32; 2], distance: i32) -> impl Iterator<Item = [i32; 2]> {
    let rows = (-distance..=distance).flat_map(move |dy| {
        let step = if dy.abs() == distance { 1 } else { (2 * distance).max(1) };
        (-distance..=distance).step_by(step as usize).map(move |dx| [dx, dy])
    });
    rows.map(move |[dx, dy]| [x.saturating_add(dx), y.saturating_add(dy)])
}
