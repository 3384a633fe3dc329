//! Made scenes: where the floor is, and what a robot can run into above it.

use std::collections::BTreeSet;

use proptest::prelude::*;

use crate::geometry::Pose;
use crate::map::{
    MapContents, MapSettings, MappedScan, MultiResolutionMap, PausingView, RobotName, Trajectory,
};
use crate::planning::grid::{
    BandFrom, Floor, Grid, GridArea, GridError, GridRequest, find_floor, project_grid, project_grid_above,
};
use crate::util::StopSignal;
use crate::voxel::{VoxelKey, VoxelSet};

pub(super) const NEVER: StopSignal<'_> = StopSignal::NEVER;
/// How high sensors are above the floor, meters.
pub(super) const SENSOR_M: f64 = 1.7;
/// What a robot of 1.8 m runs into.
pub(super) const BAND_M: [f64; 2] = [0.1, 1.8];

/// Surfaces that were seen, sampled, with where the sensor was.
pub(super) struct Scene {
    voxel_m: f64,
    pub(super) voxels: BTreeSet<[i32; 3]>,
    pub(super) places_m: Vec<[f64; 3]>,
    /// Columns of walls.
    pub(super) walls: BTreeSet<[i32; 2]>,
    /// Columns of the floor.
    pub(super) floor: BTreeSet<[i32; 2]>,
    /// The state of a generator of noise.
    noise: u64,
}

impl Scene {
    pub(super) fn new(voxel_m: f64) -> Self {
        let (voxels, places_m, walls, floor) = Default::default();
        Self { voxel_m, voxels, places_m, walls, floor, noise: 1 }
    }

    /// Up to 2 cm above or below, as a lidar measures.
    fn noise_m(&mut self) -> f64 {
        self.noise =
            self.noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.noise >> 33) as f64 / f64::from(1u32 << 31) - 0.5) * 0.04
    }

    fn point(&mut self, place_m: [f64; 3]) -> [i32; 2] {
        let [x, y, z] = place_m.map(|c| (c / self.voxel_m).floor() as i32);
        self.voxels.insert([x, y, z]);
        [x, y]
    }

    /// A floor between two corners, at a height each of `height_m`.
    pub(super) fn floor(&mut self, low_m: [f64; 2], high_m: [f64; 2], height_m: impl Fn(f64, f64) -> f64) {
        for (x, y) in samples(low_m, high_m) {
            let z = height_m(x, y) + self.noise_m();
            let column = self.point([x, y, z]);
            self.floor.insert(column);
        }
    }

    /// An upright wall along a line, from a height on, 2.5 m high.
    pub(super) fn wall(&mut self, from_m: [f64; 2], to_m: [f64; 2], foot_m: f64) {
        for (x, y) in samples(from_m, to_m) {
            for step in 0..100 {
                let column = self.point([x, y, foot_m + 0.025 * f64::from(step)]);
                self.walls.insert(column);
            }
        }
    }

    pub(super) fn map(&self, levels: u32) -> MultiResolutionMap {
        let voxels: VoxelSet = self.voxels.iter().filter_map(|&index| VoxelKey::new(index)).collect();
        let robot = RobotName::new("robot").unwrap();
        let pose = |place_m: &[f64; 3]| Pose::translation(place_m[0], place_m[1], place_m[2]);
        let scans = self.places_m.iter().zip(1..).map(|(place_m, revision)| MappedScan {
            revision,
            ..MappedScan::new(robot.clone(), pose(place_m))
        });
        let trajectory = Trajectory::new(scans, Vec::new());
        let contents = MapContents { trajectory, ..MapContents::at(self.places_m.len() as u64 + 1, voxels) };
        MultiResolutionMap::restore(MapSettings::new(self.voxel_m, levels), contents).unwrap()
    }

    /// The cells of walls that are not occupied, and those of the floor that are, of columns away from walls.
    pub(super) fn wrong(&self) -> (usize, usize) {
        let grid = grid_of(&self.map(1), self.voxel_m).unwrap();
        let is_occupied = |column: &[i32; 2]| occupied_at(&grid, *column);
        let beside_wall =
            |[x, y]: [i32; 2]| (-1..=1).any(|dx| (-1..=1).any(|dy| self.walls.contains(&[x + dx, y + dy])));
        let walls = self.walls.iter().filter(|column| !is_occupied(column)).count();
        let floor = self.floor.iter().filter(|column| !beside_wall(**column) && is_occupied(column)).count();
        (walls, floor)
    }
}

/// Places of a rectangle, three to a finest voxel.
fn samples(low_m: [f64; 2], high_m: [f64; 2]) -> impl Iterator<Item = (f64, f64)> {
    let along = move |axis: usize| {
        let count = ((high_m[axis] - low_m[axis]) / 0.017).ceil().max(1.0) as usize;
        (0..count).map(move |i| low_m[axis] + (i as f64 + 0.5) * (high_m[axis] - low_m[axis]) / count as f64)
    };
    along(1).flat_map(move |y| along(0).map(move |x| (x, y)))
}

pub(super) fn request(band_m: [f64; 2], band_from: BandFrom, cell_m: f64) -> GridRequest {
    let area = GridArea::Rectangle { min_m: [-12.0; 2], max_m: [12.0; 2] };
    GridRequest { level: 0, area, band_m, band_from, cell_m, tells_unknown: false, cells_max: 1 << 22 }
}

fn grid_of(map: &MultiResolutionMap, cell_m: f64) -> Result<Grid, GridError> {
    project_grid(&mut map.view().into(), &request(BAND_M, BandFrom::Floor, cell_m), NEVER)
}

fn occupied_at(grid: &Grid, column: [i32; 2]) -> bool {
    let first = grid.origin_m.map(|c| (c / grid.cell_m).round() as i32);
    let [x, y] = [0, 1].map(|axis| (column[axis] - first[axis]) as usize);
    grid.is_occupied(y * grid.size[0] + x)
}

/// A room from -5 to 5 m, with walls around and a robot's way through, at a height.
pub(super) fn room(scene: &mut Scene, height_m: impl Fn(f64, f64) -> f64) {
    scene.floor([-5.0, -4.0], [5.0, 4.0], &height_m);
    for [from, to] in [[[-5.0, -4.0], [5.0, -4.0]], [[-5.0, 4.0], [5.0, 4.0]]] {
        for step in 0..40 {
            let x = from[0] + 0.25 * f64::from(step);
            scene.wall([x, from[1]], [x + 0.25, to[1]], height_m(x, from[1]));
        }
    }
    for x in [-5.0, 5.0] {
        scene.wall([x, -4.0], [x, 4.0], height_m(x, 0.0));
    }
    scene.places_m.extend((-4..=4).map(f64::from).map(|x| [x, 0.0, height_m(x, 0.0) + SENSOR_M]));
}

/// Voxels of a building, of a yard and of a street, meters.
pub(super) const VOXELS_M: [f64; 3] = [0.05, 0.1, 0.2];

#[test]
fn above_a_flat_floor_walls_are_occupied_and_the_floor_is_not() {
    for voxel_m in VOXELS_M {
        for height_m in [-SENSOR_M, -1.63, 0.0, 12.34] {
            let mut scene = Scene::new(voxel_m);
            room(&mut scene, |_, _| height_m);
            assert_eq!(scene.wrong(), (0, 0), "voxels of {voxel_m} m, floor at {height_m} m");
            let grid = grid_of(&scene.map(1), voxel_m).unwrap();
            let [low_m, high_m] = grid.floor_m.unwrap();
            assert!(low_m > height_m - 0.03 && high_m < height_m + 0.03 + voxel_m, "{low_m}..{high_m}");
        }
    }
}

#[test]
fn a_ramp_of_10_degrees_is_floor_all_the_way() {
    for voxel_m in VOXELS_M {
        let mut scene = Scene::new(voxel_m);
        room(&mut scene, |x, _| 10f64.to_radians().tan() * x - 1.7);
        assert_eq!(scene.wrong(), (0, 0), "voxels of {voxel_m} m");
    }
}

#[test]
fn two_floors_beside_each_other_that_a_ramp_joins_are_floors_each() {
    for voxel_m in VOXELS_M {
        let mut scene = Scene::new(voxel_m);
        // 1 m higher to the right; a ramp of 10 degrees along the front, and a drop beside it.
        let rise = |x: f64| ((x + 3.0) * 10f64.to_radians().tan()).clamp(0.0, 1.0);
        scene.floor([-8.0, -2.0], [8.0, 0.0], |x, _| rise(x));
        scene.floor([-8.0, 0.1], [0.0, 4.0], |_, _| 0.0);
        scene.floor([0.0, 0.1], [8.0, 4.0], |_, _| 1.0);
        scene.wall([-8.0, 4.2], [0.0, 4.2], 0.0);
        scene.wall([0.0, 4.2], [8.0, 4.2], 1.0);
        // The face of the step between them, as it is seen from below.
        for (_, y) in samples([0.0, 0.5], [0.0, 4.0]) {
            for step in 0..40 {
                scene.point([0.0, y, 0.025 * f64::from(step)]);
            }
            let column = scene.point([0.0, y, 0.99]);
            scene.walls.insert(column);
        }
        // Along the ramp the step is from none to 1 m high.
        scene.floor.retain(|[x, y]| {
            let [x, y] = [x, y].map(|i| f64::from(*i) * voxel_m);
            !((-0.5..0.5).contains(&y) && (-3.5..3.5).contains(&x))
        });
        // The robot was on the lower one alone.
        scene.places_m.extend((-7..=-4).map(|x| [f64::from(x), 1.0, SENSOR_M]));
        assert_eq!(scene.wrong(), (0, 0), "voxels of {voxel_m} m");
        let floor = floor_of(&scene, voxel_m);
        let at =
            |x: f64| f64::from(height_at(&floor, [(x / voxel_m) as i32, (3.0 / voxel_m) as i32])) * voxel_m;
        assert!((at(-6.0) - 0.0).abs() <= voxel_m + 0.02 && (at(6.0) - 1.0).abs() <= voxel_m + 0.02);
    }
}

fn height_at(floor: &Floor, column: [i32; 2]) -> i32 {
    floor.within(column).map_or_else(|| floor.near(column), |height| height.base)
}

fn floor_of(scene: &Scene, voxel_m: f64) -> std::sync::Arc<Floor> {
    let map = scene.map(1);
    let mut view = PausingView::from(map.view());
    find_floor(&mut view, &request(BAND_M, BandFrom::Floor, voxel_m), NEVER).unwrap().unwrap()
}

#[test]
fn of_two_storeys_above_each_other_that_of_the_robot_counts() {
    for voxel_m in VOXELS_M {
        for storey_m in [0.0, 3.2] {
            let mut scene = Scene::new(voxel_m);
            for height_m in [0.0, 3.2, 6.4] {
                scene.floor([-5.0, -4.0], [5.0, 4.0], |_, _| height_m);
            }
            scene.walls.clear();
            scene.wall([-5.0, 2.0], [0.0, 2.0], storey_m);
            // In the other storey there is another wall.
            let walls = scene.walls.clone();
            scene.wall([0.5, -2.0], [5.0, -2.0], 3.2 - storey_m);
            scene.walls = walls;
            scene.places_m.extend((-4..=4).map(|x| [f64::from(x), 0.0, storey_m + SENSOR_M]));
            assert_eq!(scene.wrong(), (0, 0), "voxels of {voxel_m} m, storey at {storey_m} m");
        }
    }
}

#[test]
fn a_pit_and_stairs_down_are_no_floor_and_nothing_at_the_bottom_is_drawn() {
    for voxel_m in VOXELS_M {
        let mut scene = Scene::new(voxel_m);
        scene.floor([-5.0, -4.0], [5.0, -1.0], |_, _| 0.0);
        scene.floor([-5.0, 1.0], [5.0, 4.0], |_, _| 0.0);
        scene.floor([-5.0, -1.0], [-1.0, 1.0], |_, _| 0.0);
        scene.floor([1.0, -1.0], [5.0, 1.0], |_, _| 0.0);
        scene.floor([-1.0, -1.0], [1.0, 1.0], |_, _| -2.0);
        scene.wall([-5.0, 3.0], [5.0, 3.0], 0.0);
        // A flight of steps of 17 cm, 28 cm deep, goes down along the right.
        scene.floor([6.0, -4.0], [7.0, 4.0], |_, y| -0.17 * ((y + 4.0) / 0.28).floor().clamp(0.0, 20.0));
        scene.places_m.extend((-4..=4).map(|x| [f64::from(x), -2.0, SENSOR_M]));
        assert_eq!(scene.wrong(), (0, 0), "voxels of {voxel_m} m");
        let [low, _] = floor_of(&scene, voxel_m).range();
        assert!(f64::from(low) * voxel_m > -1.0, "{low}");
    }
}

#[test]
fn a_table_below_the_sensor_the_robot_itself_and_feet_are_no_floor() {
    for voxel_m in VOXELS_M {
        let mut scene = Scene::new(voxel_m);
        room(&mut scene, |_, _| 0.0);
        let is_of_floor = scene.floor.clone();
        // A table that hides what is below it from all but its edge, and a deck below each place, as wide as a robot.
        scene.voxels.retain(|[x, y, _]| {
            let [x, y] = [x, y].map(|i| (f64::from(*i) + 0.5) * voxel_m);
            !((0.3..1.7).contains(&x) && (-0.3..0.3).contains(&y))
        });
        scene.floor([0.2, -0.4], [1.8, 0.4], |_, _| 0.75);
        let place_m = [-3.0, 0.0];
        scene.floor([place_m[0] - 0.3, -0.2], [place_m[0] + 0.3, 0.2], |_, _| 1.2);
        scene.wall([2.5, -0.1], [2.7, 0.1], 0.0);
        let above: BTreeSet<[i32; 2]> = (scene.voxels.iter())
            .filter(|[x, y, z]| {
                let [x, y, z] = [x, y, z].map(|i| (f64::from(*i) + 0.5) * voxel_m);
                (0.6..1.4).contains(&z) && x.abs() < 4.5 && y.abs() < 3.5
            })
            .map(|[x, y, _]| [*x, *y])
            .collect();
        scene.floor = is_of_floor.difference(&above).copied().collect();
        scene.walls.extend(above);
        assert_eq!(scene.wrong(), (0, 0), "voxels of {voxel_m} m");
    }
}

#[test]
fn gaps_between_the_rings_of_a_lidar_are_crossed_on_the_flat_and_on_a_ramp() {
    for voxel_m in [0.05, 0.1] {
        for slope in [0.0, 0.15] {
            let mut scene = Scene::new(voxel_m);
            for ring in 0..12 {
                let x = -5.0 + 0.8 * f64::from(ring);
                scene.floor([x, -4.0], [x + 0.05, 4.0], |x, _| slope * x);
            }
            scene.wall([5.0, -4.0], [5.0, 4.0], slope * 5.0);
            scene.places_m.push([-4.0, 0.0, -4.0 * slope + SENSOR_M]);
            assert_eq!(scene.wrong(), (0, 0), "voxels of {voxel_m} m, slope {slope}");
        }
    }
}

#[test]
fn without_poses_or_anything_below_them_it_is_told_what_to_give() {
    let mut scene = Scene::new(0.1);
    room(&mut scene, |_, _| 0.0);
    let places_m = std::mem::take(&mut scene.places_m);
    let said = |scene: &Scene| grid_of(&scene.map(1), 0.1).unwrap_err().to_string();
    assert!(
        said(&scene).contains("neither viewpoints nor a trajectory")
            && said(&scene).contains("band_from map")
    );
    // A robot in the cellar, of which nothing was seen; and one that sees a plane alone.
    scene.places_m = vec![[0.0, 0.0, -5.0], [1.0, 0.0, -5.0]];
    assert!(said(&scene).contains("below any of 2 places") && said(&scene).contains("band_from map"));
    let mut plane = Scene::new(0.1);
    plane.places_m = places_m;
    for angle in (0..400).map(|i| f64::from(i) / 30.0) {
        plane.point([angle.cos() * 4.0, angle.sin() * 4.0, 1.7]);
    }
    assert!(said(&plane).contains("below any of 9 places"));
    // Without bounds nothing counts from anywhere.
    let all = request([f64::NEG_INFINITY, f64::INFINITY], BandFrom::Floor, 0.1);
    let grid = project_grid(&mut scene.map(1).view().into(), &all, NEVER).unwrap();
    assert!(grid.floor_m.is_none() && (0..grid.cells()).any(|number| grid.is_occupied(number)));
}

#[test]
fn a_stopped_search_for_the_floor_ends() {
    let mut scene = Scene::new(0.05);
    room(&mut scene, |_, _| 0.0);
    let map = scene.map(1);
    let floor = |most: usize| {
        let looks = std::cell::Cell::new(0);
        let stops = || looks.replace(looks.get() + 1) >= most;
        let found = find_floor(
            &mut map.view().into(),
            &request(BAND_M, BandFrom::Floor, 0.05),
            StopSignal::when(&stops),
        );
        (found, looks.get())
    };
    let (whole, all) = floor(usize::MAX);
    for most in 0..all {
        let (found, looks) = floor(most);
        assert!(looks <= most + 20, "{looks} looks of which {most} let it go on");
        assert!(found.is_ok() && most + 1 == all || found != whole, "it says that it is whole");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn above_a_level_floor_a_grid_is_that_of_a_band_of_the_map_that_begins_there(
        height in -40i32..40,
        posts in prop::collection::vec((prop::array::uniform2(-30i32..30), 5i32..30), 0..30),
        floating in prop::collection::vec((prop::array::uniform2(-30i32..30), 8i32..40), 0..30),
        holes in prop::collection::vec(prop::array::uniform2(-30i32..30), 0..200),
        low in 0.0f64..2.0, tall in 0.0f64..2.0, cell in 1u32..4,
    ) {
        let mut scene = Scene::new(0.1);
        let columns = (-30..30).flat_map(|x| (-30..30).map(move |y| [x, y]));
        scene.voxels.extend(columns.filter(|column| !holes.contains(column)).map(|[x, y]| [x, y, height]));
        scene.voxels.extend(posts.iter().flat_map(|([x, y], tall)| (0..=*tall).map(move |z| [*x, *y, height + z])));
        scene.voxels.extend(floating.iter().map(|([x, y], z)| [*x, *y, height + z]));
        let floor_m = f64::from(height + 1) * 0.1;
        // Above all that is there.
        scene.places_m.push([0.05, 0.05, floor_m + 0.35]);
        let map = scene.map(1);
        let cell_m = f64::from(cell) * 0.1;
        let from_floor = project_grid(&mut map.view().into(), &request([low, low + tall], BandFrom::Floor, cell_m), NEVER).unwrap();
        let band_m = [low + floor_m, low + tall + floor_m];
        let from_map = project_grid(&mut map.view().into(), &request(band_m, BandFrom::Map, cell_m), NEVER).unwrap();
        prop_assert_eq!(&from_floor.occupied, &from_map.occupied);
        let bits = |grid: &Grid| grid.tops_m.iter().map(|top| top.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&from_floor), bits(&from_map));
        prop_assert!(from_floor.floor_m.unwrap().iter().all(|c| (c - floor_m).abs() < 1e-9));
    }

    #[test]
    fn a_voxel_counts_by_its_height_above_the_floor_of_its_column_and_every_column_has_one_near_it(
        floor in prop::collection::vec(prop::array::uniform3(-20i32..20), 1..60),
        voxels in prop::collection::vec(prop::array::uniform3(-60i32..60), 0..60),
        low in -20i32..20, tall in 0i32..20,
    ) {
        let floor = Floor::of(0.1, floor.into_iter().map(|voxel| (voxel, voxel[2])), NEVER);
        let mut scene = Scene::new(0.1);
        scene.voxels.extend(&voxels);
        let map = scene.map(1);
        let band_m = [low, low + tall + 1].map(|i| f64::from(i) * 0.1);
        let grid = project_grid_above(&mut map.view().into(), &request(band_m, BandFrom::Floor, 0.1), Some(&floor), NEVER).unwrap();
        let expected: BTreeSet<[i32; 2]> = (voxels.iter())
            .filter(|[x, y, z]| (low..=low + tall).contains(&(z - height_at(&floor, [*x, *y]))))
            .map(|[x, y, _]| [*x, *y])
            .collect();
        for column in voxels.iter().map(|[x, y, _]| [*x, *y]) {
            prop_assert_eq!(occupied_at(&grid, column), expected.contains(&column));
        }
        prop_assert_eq!((0..grid.cells()).filter(|&number| grid.is_occupied(number)).count(), expected.len());
        // Never much further than the nearest column of the floor.
        for column in voxels.iter().map(|[x, y, _]| [*x, *y]).filter(|column| floor.within(*column).is_none()) {
            let apart = |to: &[i32; 2]| f64::from(to[0] - column[0]).hypot(f64::from(to[1] - column[1]));
            let nearest = floor.columns().map(|of| apart(&of)).fold(f64::INFINITY, f64::min);
            let same = floor.columns().filter(|of| floor.within(*of).unwrap().floor == floor.near(column));
            let taken = same.map(|of| apart(&of)).fold(f64::INFINITY, f64::min);
            prop_assert!(taken <= 6.0 * nearest, "{} columns away, {} is the nearest", taken, nearest);
        }
    }
}
