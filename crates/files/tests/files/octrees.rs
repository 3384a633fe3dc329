//! Octrees of OctoMap, read and written.

use std::collections::{BTreeMap, BTreeSet};

use mrol_files::octree::{
    CELL_INDEX_MAX, CELL_INDEX_MIN, CellState, Leaf, LeafError, Octree, OctreeReader, OctreeVoxels,
};
use mrol_map::voxel::{VoxelKey, VoxelSet};
use proptest::prelude::*;

use crate::support::{fixture, leaves_of, shared};

const RESOLUTION_M: f64 = 0.05;

fn binary(tree: &Octree, resolution_m: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    tree.write_binary(resolution_m, &mut bytes).unwrap();
    bytes
}

fn full(tree: &Octree, resolution_m: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    tree.write_full(resolution_m, &mut bytes).unwrap();
    bytes
}

/// What follows the lines of a header.
fn data(bytes: &[u8]) -> &[u8] {
    let at = bytes.windows(6).position(|window| window == b"\ndata\n").unwrap();
    &bytes[at + 6..]
}

fn voxels_of(bytes: &[u8], coarser: u32) -> OctreeVoxels {
    OctreeVoxels::read(&mut OctreeReader::new(bytes).unwrap(), coarser, |_| {}).unwrap()
}

/// Finest cells with their states, some of them in cubes.
fn cells() -> impl Strategy<Value = BTreeMap<[i32; 3], CellState>> {
    let state = prop_oneof![Just(CellState::Free), Just(CellState::Occupied)];
    let index = prop_oneof![4 => -40..40, 1 => CELL_INDEX_MIN..=CELL_INDEX_MAX];
    let single = (prop::array::uniform3(index), Just(0_u32), state.clone());
    let cube = (prop::array::uniform3(-5..5), 1..=3_u32, state);
    prop::collection::vec(prop_oneof![6 => single, 1 => cube], 0..120).prop_map(|parts| {
        let mut cells = BTreeMap::new();
        for (index, level, state) in parts {
            let side = 1 << level;
            for cell in 0..side * side * side {
                let offset = [cell % side, cell / side % side, cell / (side * side)];
                cells.insert([0, 1, 2].map(|axis| index[axis] * side + offset[axis]), state);
            }
        }
        cells
    })
}

fn finest(leaves: &[Leaf]) -> BTreeMap<[i32; 3], CellState> {
    let mut cells = BTreeMap::new();
    for leaf in leaves {
        let side = 1 << leaf.level;
        for cell in 0..side * side * side {
            let offset = [cell % side, cell / side % side, cell / (side * side)];
            let before =
                cells.insert([0, 1, 2].map(|axis| leaf.index[axis] * side + offset[axis]), leaf.state);
            assert_eq!(before, None, "{leaf:?} overlaps another leaf");
        }
    }
    cells
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn cells_come_back_from_both_kinds_of_files(cells in cells()) {
        let leaf = |(&index, &state): (&[i32; 3], &CellState)| Leaf { index, level: 0, state };
        let tree = Octree::of(cells.iter().map(leaf)).unwrap();
        for bytes in [binary(&tree, RESOLUTION_M), full(&tree, RESOLUTION_M)] {
            prop_assert_eq!(OctreeReader::new(&bytes[..]).unwrap().resolution_m(), RESOLUTION_M);
            let leaves = leaves_of(&bytes).unwrap();
            prop_assert!(leaves.iter().copied().eq(tree.leaves()));
            prop_assert_eq!(&finest(&leaves), &cells);
            // What was read is pruned, and in order.
            let mut again = Octree::default();
            leaves.iter().for_each(|leaf| again.push(*leaf).unwrap());
            prop_assert_eq!(&again, &tree);
        }
    }

    #[test]
    fn occupied_cells_are_voxels_and_parts_of_coarser_ones(cells in cells(), coarser in 0_u32..5) {
        let leaf = |(&index, &state): (&[i32; 3], &CellState)| Leaf { index, level: 0, state };
        let tree = Octree::of(cells.iter().map(leaf)).unwrap();
        let occupied = cells.iter().filter(|(_, state)| **state == CellState::Occupied);
        let expected: VoxelSet =
            occupied.map(|(index, _)| VoxelKey::new(*index).unwrap().ancestor(coarser)).collect();
        for bytes in [binary(&tree, RESOLUTION_M), full(&tree, RESOLUTION_M)] {
            let read = voxels_of(&bytes, coarser);
            prop_assert_eq!(&read.voxels, &expected);
            prop_assert_eq!((read.occupied + read.free) as usize, tree.len());
        }
    }
}

#[test]
fn trees_that_octomap_wrote_have_the_leaves_that_it_lists() {
    let listed = String::from_utf8(fixture("leaves.txt")).unwrap();
    let listed: Vec<Leaf> = listed
        .lines()
        .map(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            let number = |word: usize| words[word].parse::<i32>().unwrap();
            let state = if words[4] == "occupied" { CellState::Occupied } else { CellState::Free };
            Leaf { index: [0, 1, 2].map(number), level: number(3).cast_unsigned(), state }
        })
        .collect();
    assert!(listed.len() > 100 && listed.iter().any(|leaf| leaf.level > 0));
    for name in ["certain.bt", "certain.ot", "measured.ot", "colored.ot"] {
        let bytes = fixture(name);
        assert_eq!(leaves_of(&bytes).unwrap(), listed, "{name}");
        assert_eq!(OctreeReader::new(&bytes[..]).unwrap().resolution_m(), 0.25, "{name}");
    }
}

#[test]
fn trees_of_octomap_come_back_byte_for_byte() {
    let tree = Octree::of(leaves_of(&fixture("certain.bt")).unwrap()).unwrap();
    assert_eq!(binary(&tree, 0.25), fixture("certain.bt"));
    assert_eq!(full(&tree, 0.25), fixture("certain.ot"));
}

#[test]
fn a_building_of_octomap_comes_back_byte_for_byte() {
    let Some(bytes) = shared("octomap/geb079.bt") else { return };
    let leaves = leaves_of(&bytes).unwrap();
    let occupied = leaves.iter().filter(|leaf| leaf.state == CellState::Occupied).count();
    // As many boxes as `bt2vrml` of OctoMap draws.
    assert_eq!(occupied, OCCUPIED_OF_BUILDING);
    let mut tree = Octree::default();
    leaves.iter().for_each(|leaf| tree.push(*leaf).unwrap());
    assert!(binary(&tree, 0.08) == bytes);
    assert_eq!(voxels_of(&bytes, 0).occupied, occupied as u64);
}

/// Occupied leaves of the building.
const OCCUPIED_OF_BUILDING: usize = 143_729;

#[test]
fn one_voxel_is_a_path_of_sixteen_nodes() {
    // As `clients/ros2` writes it.
    let tree = Octree::of([Leaf { index: [0; 3], level: 0, state: CellState::Occupied }]).unwrap();
    let bytes = binary(&tree, RESOLUTION_M);
    let words: Vec<u16> = data(&bytes).chunks(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect();
    assert_eq!(words, [vec![3 << 14], vec![3; 14], vec![2]].concat());
    let header = String::from_utf8_lossy(&bytes);
    assert!(header.starts_with("# Octomap OcTree binary file\n"), "{header}");
    assert!(header.contains("\nid OcTree\nsize 17\nres 0.05\ndata\n"), "{header}");
}

#[test]
fn a_tree_of_nothing_has_no_node() {
    for bytes in [binary(&Octree::default(), RESOLUTION_M), full(&Octree::default(), RESOLUTION_M)] {
        assert!(data(&bytes).is_empty());
        assert_eq!(leaves_of(&bytes).unwrap(), []);
    }
}

#[test]
fn a_root_without_children_is_all_of_space() {
    let mut bytes = b"# Octomap OcTree file\nid OcTree\nsize 1\nres 1\ndata\n".to_vec();
    bytes.extend(3.0_f32.to_le_bytes());
    bytes.push(0);
    let leaves = leaves_of(&bytes).unwrap();
    let corners: BTreeSet<[i32; 3]> = leaves.iter().map(|leaf| leaf.index).collect();
    assert_eq!((leaves.len(), corners.len()), (8, 8));
    assert!(leaves.iter().all(|leaf| leaf.level == 15 && leaf.state == CellState::Occupied), "{leaves:?}");
    assert!(corners.contains(&[-1, 0, -1]));
}

#[test]
fn cells_outside_of_a_tree_and_overlapping_ones_are_refused() {
    let leaf = |index: [i32; 3], level| Leaf { index, level, state: CellState::Free };
    let outside = Octree::of([leaf([CELL_INDEX_MAX + 1, 0, 0], 0)]).unwrap_err();
    assert!(
        outside.to_string().starts_with("cell [32768, 0, 0] of level 0 lies beyond an octree"),
        "{outside}"
    );
    for second in [leaf([0; 3], 0), leaf([1; 3], 0), leaf([0; 3], 3)] {
        let refused = Octree::of([leaf([0; 3], 1), second]);
        assert!(matches!(refused, Err(LeafError::Order { .. })), "{second:?}");
    }
}
