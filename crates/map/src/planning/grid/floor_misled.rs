//! Scenes that misled a search for the floor: storeys above things that hide the floor, a robot that sees itself, and
//! surfaces of which none is a floor.

use std::cell::Cell;

use super::floor_scenes::{BAND_M, SENSOR_M, Scene, VOXELS_M, request, room};
use crate::planning::grid::{BandFrom, find_floor};
use crate::util::StopSignal;
use crate::voxel::{VoxelKey, VoxelSet};

#[test]
fn a_storey_above_is_not_the_floor_of_what_stands_below_it() {
    for voxel_m in VOXELS_M {
        let mut scene = Scene::new(voxel_m);
        room(&mut scene, |_, _| 0.0);
        // Nobody saw the floor below a box of 1 m.
        scene.voxels.retain(|[x, y, z]| {
            let [x, y] = [x, y].map(|i| (f64::from(*i) + 0.5) * voxel_m);
            *z > 1 || !((1.0..2.0).contains(&x) && (1.0..2.0).contains(&y))
        });
        let floor = scene.floor.clone();
        for height in 0..40 {
            scene.floor([1.0, 1.0], [2.0, 2.0], |_, _| 0.1 + 0.025 * f64::from(height));
        }
        let box_of = |[x, y]: &[i32; 2]| {
            let [x, y] = [x, y].map(|i| (f64::from(*i) + 0.5) * voxel_m);
            (1.0..2.0).contains(&x) && (1.0..2.0).contains(&y)
        };
        scene.walls.extend(floor.iter().filter(|column| box_of(column)));
        scene.floor = floor.iter().filter(|column| !box_of(column)).copied().collect();
        let ground = scene.floor.clone();
        // Another robot was in three places of the storey above.
        scene.floor([-5.0, -4.0], [5.0, 4.0], |_, _| 3.2);
        scene.floor = ground;
        scene.places_m.extend((0..3).map(|x| [f64::from(x), 0.0, 3.2 + SENSOR_M]));
        assert_eq!(scene.wrong(), (0, 0), "voxels of {voxel_m} m");
    }
}

#[test]
fn what_a_robot_sees_of_itself_along_its_way_is_no_floor() {
    for voxel_m in VOXELS_M {
        let mut scene = Scene::new(voxel_m);
        room(&mut scene, |_, _| 0.0);
        let floor = scene.floor.clone();
        // Its deck, over all of its way.
        scene.floor([-4.5, -0.3], [4.5, 0.3], |_, _| 0.85);
        let deck = |[_, y]: &[i32; 2]| ((f64::from(*y) + 0.5) * voxel_m).abs() < 0.3 + voxel_m;
        scene.floor = floor.iter().filter(|column| !deck(column)).copied().collect();
        scene.wall([2.0, 2.0], [2.4, 2.0], 0.0);
        assert_eq!(scene.wrong(), (0, 0), "voxels of {voxel_m} m");
    }
}

#[test]
fn surfaces_that_are_no_floor_keep_nobody_waiting() {
    let mut scene = Scene::new(0.03);
    // Each column around the sensor has something at another height.
    let height = |x: i32, y: i32| -3 - (x.wrapping_mul(7919) ^ y.wrapping_mul(104_729)).rem_euclid(90_000);
    scene.voxels.extend((-128..=128).flat_map(|y| (-128..=128).map(move |x| [x, y, height(x, y)])));
    scene.places_m.push([0.0; 3]);
    let map = scene.map(1);
    let looks = Cell::new(0);
    let stops = || {
        if looks.get() == 150 {
            // A change of the map need not wait: it would do so for ever here.
            map.committer().exchange(&VoxelSet::default(), &VoxelKey::new([500, 0, 0]).into_iter().collect());
        }
        looks.replace(looks.get() + 1) >= 200
    };
    let found =
        find_floor(&mut map.view().into(), &request(BAND_M, BandFrom::Floor, 0.03), StopSignal::when(&stops));
    // It looks at the signal all the time, and ends soon after that says so.
    assert!((200..400).contains(&looks.get()), "{} looks", looks.get());
    assert!(found.is_ok(), "what was stopped lacks parts, and is no error");
}
