//! The floor of a street, found below the car that drove along it.

use std::collections::HashMap;

use mrol::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol::planning::{BandFrom, Grid, GridArea, GridRequest, project_grid};
use mrol::util::StopSignal;

use crate::support::shared_scans;

const VOXEL_M: f64 = 0.2;

/// The map of the street at its true poses, as its scans leave it without carving.
fn street() -> Option<MultiResolutionMap> {
    let set = shared_scans::open("street_hdl64")?;
    let map = MultiResolutionMap::new(MapSettings::new(VOXEL_M, 4)).unwrap();
    let robot = RobotName::new("car").unwrap();
    for (k, map_from_sensor) in set.map_from_sensor.iter().enumerate() {
        let scan = MappedScan::new(robot.clone(), *map_from_sensor);
        map.committer().insert_scan(ScanRecord::of_points(scan, &set.points(k), map.lattice()));
    }
    Some(map)
}

fn grid(map: &MultiResolutionMap, band_m: [f64; 2], band_from: BandFrom) -> Grid {
    let request = GridRequest {
        level: 0,
        area: GridArea::Occupied,
        band_m,
        band_from,
        cell_m: VOXEL_M,
        tells_unknown: false,
        cells_max: 1 << 24,
    };
    project_grid(&mut map.view().into(), &request, StopSignal::NEVER).unwrap()
}

fn occupied_count(grid: &Grid) -> usize {
    grid.occupied.iter().map(|word| word.count_ones() as usize).sum()
}

/// How many voxels of a band of the map are above each other in a column, by its index.
fn heights_of_columns(map: &MultiResolutionMap, [low_m, high_m]: [f64; 2]) -> HashMap<[i32; 2], usize> {
    let mut columns = HashMap::new();
    let view = map.view();
    for [x, y, z] in view.lists(0).flat_map(|list| list.iter()).map(|voxel| voxel.index()) {
        let center_m = (f64::from(z) + 0.5) * VOXEL_M;
        if (low_m..high_m).contains(&center_m) {
            *columns.entry([x, y]).or_default() += 1;
        }
    }
    columns
}

fn is_occupied(grid: &Grid, column: [i32; 2]) -> bool {
    let first = grid.origin_m.map(|c| (c / grid.cell_m).round() as i32);
    let [x, y] = [0, 1].map(|axis| column[axis] - first[axis]);
    let is_inside = |at: i32, size: usize| usize::try_from(at).is_ok_and(|at| at < size);
    is_inside(x, grid.size[0])
        && is_inside(y, grid.size[1])
        && grid.is_occupied(y as usize * grid.size[0] + x as usize)
}

/// What stands on the road and is 0.6 m high is in a robot's way. What is a voxel high is mostly ground that rises: a
/// band by hand, that begins on the road below the car, has it all.
#[test]
fn the_band_of_a_robot_counts_from_the_road_and_not_from_the_sensor_on_the_roof() {
    let Some(map) = street() else { return };
    // The sensor is 1.73 m above the road, which lies in the voxels below -1.6 m.
    let by_hand_m = [-1.6, 0.0];
    let by_hand = grid(&map, by_hand_m, BandFrom::Map);
    let from_sensor = grid(&map, [0.1, 1.8], BandFrom::Map);
    let from_floor = grid(&map, [0.1, 1.8], BandFrom::Floor);
    let columns = heights_of_columns(&map, by_hand_m);
    let of_height = |least: usize, most: usize| {
        let all: Vec<[i32; 2]> = columns
            .iter()
            .filter(|(_, height)| (least..=most).contains(*height))
            .map(|(column, _)| *column)
            .collect();
        let kept = |grid: &Grid| all.iter().filter(|column| is_occupied(grid, **column)).count() as f64;
        (kept(&from_floor) / all.len() as f64, kept(&from_sensor) / all.len() as f64)
    };
    let (high, low, high_from_sensor) = (of_height(3, 9).0, of_height(1, 1).0, of_height(3, 9).1);
    println!(
        "occupied: {} cells by hand, {} from the sensor, {} from the floor; of columns of 0.6 m and more {:.2} % from the \
         floor and {:.0} % from the sensor, of those of one voxel {:.0} %; floor {:?}",
        occupied_count(&by_hand),
        occupied_count(&from_sensor),
        occupied_count(&from_floor),
        high * 100.0,
        high_from_sensor * 100.0,
        low * 100.0,
        from_floor.floor_m
    );
    assert!(high > 0.99, "{high} of what stands on the road");
    assert!(low < 0.5, "{low} of what is a voxel high");
    assert!(high_from_sensor < 0.9, "{high_from_sensor} of what stands on the road");
    let [low_m, high_m] = from_floor.floor_m.unwrap();
    assert!(low_m < -1.5 && high_m > -1.8, "{low_m}..{high_m}");
}
