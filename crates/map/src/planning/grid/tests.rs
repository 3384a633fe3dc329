use proptest::prelude::*;
use std::collections::BTreeMap;

use super::*;
use crate::map::{MapContents, MapSettings, MultiResolutionMap, PausingView};
use crate::planning::tests::{RESOLUTION_M, history_and_level, seen_history_and_level};
use crate::util::StopSignal;
use crate::voxel::{VoxelKey, VoxelSet};

fn map_of(indices: &[[i32; 3]], resolution_m: f64) -> MultiResolutionMap {
    let voxels: VoxelSet = indices.iter().filter_map(|&index| VoxelKey::new(index)).collect();
    MultiResolutionMap::restore(MapSettings::new(resolution_m, 3), MapContents::at(1, voxels)).unwrap()
}

fn project(map: &MultiResolutionMap, request: &GridRequest) -> Result<Grid, GridError> {
    project_grid(&mut map.view().into(), request, StopSignal::NEVER)
}

const REQUEST: GridRequest = GridRequest {
    level: 0,
    area: GridArea::Occupied,
    band_m: [f64::NEG_INFINITY, f64::INFINITY],
    band_from: BandFrom::Map,
    cell_m: 0.1,
    tells_unknown: false,
    cells_max: 1000,
};

/// True where a voxel with its center at height `z` has more than a border in common with a band, or holds its low end.
fn reaches_into([low, high]: [f64; 2], z: f64, voxel_m: f64) -> bool {
    let (bottom, top, near) = (z - voxel_m / 2.0, z + voxel_m / 2.0, 1e-6 * voxel_m);
    top > low + near && (bottom < high - near || bottom <= low + near)
}

/// The height of the highest voxel of each cell that has one, by the cell's index.
fn tops_of_all(map: &MultiResolutionMap, request: &GridRequest) -> BTreeMap<[i64; 2], f32> {
    let (view, voxel_m) = (map.view(), map.lattice().resolution_m(request.level));
    let mut tops = BTreeMap::new();
    for voxel in view.lists(request.level).flat_map(|list| list.iter()) {
        let [x, y, z] = map.lattice().center_m(voxel, request.level);
        if reaches_into(request.band_m, z, voxel_m) {
            let cell = [x, y].map(|c| (c / request.cell_m).floor() as i64);
            let top = tops.entry(cell).or_insert(f32::NEG_INFINITY);
            *top = top.max((f64::from(voxel.index()[2] + 1) * voxel_m) as f32);
        }
    }
    tops
}

/// The same of a grid.
fn tops_of(grid: &Grid) -> BTreeMap<[i64; 2], f32> {
    let first = grid.origin_m.map(|c| (c / grid.cell_m).round() as i64);
    let occupied = (0..grid.cells()).filter(|&number| grid.is_occupied(number));
    let cell = |number: usize| [number % grid.size[0], number / grid.size[0]];
    let index = |number| std::array::from_fn(|axis| first[axis] + cell(number)[axis] as i64);
    occupied.map(|number| (index(number), grid.tops_m[number])).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, max_shrink_iters: 2000, ..ProptestConfig::default() })]

    #[test]
    fn a_grid_has_what_a_look_at_every_voxel_finds(
        (history, level) in history_and_level(),
        low in prop::array::uniform2(-30.0f64..30.0),
        size in prop::array::uniform2(prop_oneof![Just(0.0), 0.0f64..40.0]),
        cell_voxels in 1u32..6,
        band_m in prop_oneof![
            Just([f64::NEG_INFINITY, f64::INFINITY]),
            (-20.0f64..20.0, 0.0f64..10.0).prop_map(|(low, height)| [low, low + height]),
            (-30i32..30, 0i32..9).prop_map(|(low, height)| [low, low + height].map(|i| (f64::from(i) + 0.5) * RESOLUTION_M)),
            // Borders of voxels, and bands without height.
            (-30i32..30, 0i32..9).prop_map(|(low, height)| [low, low + height].map(|i| f64::from(i) * RESOLUTION_M)),
            (-20.0f64..20.0).prop_map(|at| [at, at]),
        ],
    ) {
        let map = history.map();
        let cell_m = f64::from(cell_voxels) * map.lattice().resolution_m(level);
        let high = std::array::from_fn(|axis| low[axis] + size[axis]);
        let area = GridArea::Rectangle { min_m: low, max_m: high };
        let request = GridRequest { level, area, band_m, band_from: BandFrom::Map, cell_m, tells_unknown: false, cells_max: 1_000_000 };
        let grid = project(&map, &request).unwrap();
        let end = |axis: usize| grid.origin_m[axis] + grid.size[axis] as f64 * cell_m;
        let near = 1e-5 * cell_m;
        for axis in 0..2 {
            prop_assert!(grid.origin_m[axis] <= low[axis] + near && low[axis] < grid.origin_m[axis] + cell_m + near);
            prop_assert!(end(axis) + near >= high[axis] && end(axis) < high[axis].max(low[axis]) + cell_m + near);
        }
        let is_inside = |cell: &[i64; 2]| (0..2).all(|axis| {
            let center = (cell[axis] as f64 + 0.5) * cell_m;
            center > grid.origin_m[axis] && center < end(axis)
        });
        let mut expected = tops_of_all(&map, &request);
        expected.retain(|cell, _| is_inside(cell));
        prop_assert_eq!(tops_of(&grid), expected);
        for (number, top) in grid.tops_m.iter().enumerate() {
            prop_assert_eq!(top.is_nan(), !grid.is_occupied(number));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn a_cell_is_free_where_every_column_of_it_has_a_free_voxel_in_the_band(
        (history, level) in seen_history_and_level(),
        low in prop::array::uniform2(-8.0f64..4.0),
        size in prop::array::uniform2(0.0f64..6.0),
        cell_voxels in 1u32..4,
        band_m in prop_oneof![Just([f64::NEG_INFINITY, f64::INFINITY]), (-4.0f64..4.0, 0.0f64..3.0).prop_map(|(low, height)| [low, low + height])],
    ) {
        let seen = history.map();
        let voxel_m = seen.map.lattice().resolution_m(level);
        let cell_m = f64::from(cell_voxels) * voxel_m;
        let area = GridArea::Rectangle { min_m: low, max_m: std::array::from_fn(|axis| low[axis] + size[axis]) };
        let request = GridRequest { level, area, band_m, band_from: BandFrom::Map, cell_m, tells_unknown: true, cells_max: 1_000_000 };
        let mut view = PausingView::from(seen.map.view().with_viewpoints());
        let grid = project_grid(&mut view, &request, StopSignal::NEVER).unwrap();
        let free = grid.free.as_ref().unwrap();
        let first = grid.origin_m.map(|c| (c / voxel_m).round() as i32);
        // Nobody sees further than this.
        let far = (20.0 / voxel_m) as i32 + 2;
        for number in 0..grid.cells() {
            let cell = [number % grid.size[0], number / grid.size[0]].map(|i| i as i32 * cell_voxels as i32);
            let column_is_free = |x: i32, y: i32| (-far..far).any(|z| {
                let voxel = VoxelKey::new([first[0] + cell[0] + x, first[1] + cell[1] + y, z]).unwrap();
                let height = seen.map.lattice().center_m(voxel, level)[2];
                reaches_into(band_m, height, voxel_m) && seen.is_free(view.view(), voxel, level)
            });
            let side = 0..cell_voxels as i32;
            let all = side.clone().all(|y| side.clone().all(|x| column_is_free(x, y)));
            let is_free = free[number / 64] >> (number % 64) & 1 == 1;
            prop_assert_eq!(is_free, all && !grid.is_occupied(number), "cell {}", number);
            prop_assert_eq!(grid.is_unknown(number), !is_free && !grid.is_occupied(number));
        }
    }
}

#[test]
fn a_wall_is_drawn_in_a_band_that_holds_no_center_of_a_voxel() {
    let wall: Vec<[i32; 3]> = (0..12).flat_map(|y| (0..20).map(move |z| [3, y, z])).collect();
    let map = map_of(&wall, 0.1);
    // Levels of 0.1, 0.2 and 0.4 m, with heights that lie between two rows of centers, on a border, and on one center.
    for (level, band_m) in [
        (0, [0.16, 0.24]),
        (0, [0.5, 0.5]),
        (0, [0.55, 0.55]),
        (0, [0.51, 0.52]),
        (1, [0.11, 0.29]),
        (2, [0.25, 0.55]),
        (2, [0.05, 0.15]),
    ] {
        let cell_m = map.lattice().resolution_m(level);
        let grid = project(&map, &GridRequest { level, band_m, cell_m, ..REQUEST }).unwrap();
        let occupied = (0..grid.cells()).filter(|&number| grid.is_occupied(number)).count();
        assert_eq!(occupied, 12 >> level, "level {level}, band {band_m:?}");
    }
    // What only touches the band from below or above does not count: a floor does not where the band begins on it.
    let on_the_wall = project(&map, &GridRequest { band_m: [2.0, 3.0], ..REQUEST }).unwrap();
    let below_it = project(&map, &GridRequest { band_m: [-1.0, 0.0], ..REQUEST }).unwrap();
    assert_eq!((on_the_wall.cells(), below_it.cells()), (0, 0));
}

#[test]
fn a_grid_of_what_is_there_is_as_small_as_can_be() {
    let map = map_of(&[[-3, 4, 0], [5, 9, 7], [0, 100, 50]], 0.1);
    let grid = project(&map, &GridRequest { band_m: [0.0, 1.0], ..REQUEST }).unwrap();
    assert_eq!((grid.size, grid.cells()), ([9, 6], 54));
    assert!((grid.origin_m[0] + 0.3).abs() < 1e-12 && (grid.origin_m[1] - 0.4).abs() < 1e-12);
    assert_eq!((grid.tops_m[0], grid.tops_m[53]), (0.1, 0.8));
    let nothing = project(&map, &GridRequest { band_m: [20.0, 30.0], ..REQUEST }).unwrap();
    assert_eq!((nothing.size, nothing.cells()), ([0, 0], 0));
}

#[test]
fn numbers_that_are_whole_but_for_rounding_count_as_whole() {
    let map = map_of(&[[0, 0, 0]], 0.1);
    // 0.3 / 0.1 is less than 3, and 0.7 / 0.1 too.
    let area = GridArea::Rectangle { min_m: [0.3, 0.3], max_m: [0.7, 0.7] };
    assert_eq!(project(&map, &GridRequest { area, ..REQUEST }).unwrap().size, [4, 4]);
    assert!(project(&map, &GridRequest { area, cell_m: 0.3, ..REQUEST }).is_ok());
}

#[test]
fn what_cannot_be_drawn_is_named() {
    let map = map_of(&[[0, 0, 0], [99, 9, 0]], 0.1);
    let said = |request| project(&map, &request).unwrap_err().to_string();
    for cell_m in [0.05, 0.15, 0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(
            said(GridRequest { cell_m, ..REQUEST }).starts_with("cell_m must be a whole number of voxels")
        );
    }
    for (min_m, max_m) in
        [([0.0, 1.0], [1.0, 0.0]), ([f64::NAN, 0.0], [1.0; 2]), ([0.0; 2], [f64::INFINITY, 1.0])]
    {
        let area = GridArea::Rectangle { min_m, max_m };
        assert!(said(GridRequest { area, ..REQUEST }).starts_with("area.min_m must be finite"));
    }
    for band_m in [[1.0, 0.0], [f64::NAN, 1.0]] {
        assert!(said(GridRequest { band_m, ..REQUEST }).starts_with("min_z_m must be at most max_z_m, got "));
    }
    assert!(project(&map, &REQUEST).is_ok(), "a thousand cells");
    assert!(
        said(GridRequest { cells_max: 999, ..REQUEST })
            .contains("may have 999 cells, the area has 1000 of 0.1 m")
    );
    let (min, max) = map.lattice().range_m();
    let area = GridArea::Rectangle { min_m: [min; 2], max_m: [max; 2] };
    assert!(said(GridRequest { area, ..REQUEST }).contains("may have 1000 cells"));
    let far = |min_m, max_m| said(GridRequest { area: GridArea::Rectangle { min_m, max_m }, ..REQUEST });
    let limits = format!("within {min} m and {max} m");
    for (told, field) in [
        (far([1e300; 2], [1e300; 2]), "area.min_m"),
        (far([0.0, min - 0.1], [1.0; 2]), "area.min_m"),
        (far([0.0; 2], [max + 0.1, 1.0]), "area.max_m"),
    ] {
        assert!(told.starts_with(field) && told.contains(&limits), "{told}");
    }
}

#[test]
fn the_files_of_map_server_show_the_map_from_above() {
    let map = map_of(&[[0, 0, 0], [2, 1, 0]], 0.1);
    let grid = project(&map, &REQUEST).unwrap();
    let rows = [[254, 254, 0], [0, 254, 254]];
    assert_eq!(grid.to_pgm(), [b"P5\n3 2\n255\n".as_slice(), rows.as_flattened()].concat());
    // Of a map that nobody looked through.
    let told = project(&map, &GridRequest { tells_unknown: true, ..REQUEST }).unwrap();
    assert_eq!(told.to_pgm().iter().filter(|&&gray| gray == 205).count(), 4);
    let yaml = "image: 'it''s.pgm'\nmode: trinary\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    assert_eq!(grid.to_yaml("it's.pgm"), yaml);
}
