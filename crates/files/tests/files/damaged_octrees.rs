//! Octrees that are cut off, changed, or claim what is not there.

use mrol_files::octree::{Leaf, OctreeError, OctreeReader, OctreeVoxels};

use crate::support::{fixture, leaves_of, random};

const HEADER: &str = "# Octomap OcTree binary file\nid OcTree\nsize 17\nres 0.05\ndata\n";

fn refused(bytes: &[u8]) -> String {
    leaves_of(bytes).unwrap_err().to_string()
}

#[test]
fn a_file_that_is_cut_off_anywhere_is_refused() {
    for name in ["certain.bt", "measured.ot", "colored.ot"] {
        let bytes = fixture(name);
        let header = bytes.windows(6).position(|window| window == b"\ndata\n").unwrap() + 6;
        for length in 0..bytes.len() {
            let error = leaves_of(&bytes[..length]).expect_err("a part of a tree is no tree");
            let message = error.to_string();
            match length {
                // The last line has no end yet.
                _ if length + 1 >= header => {
                    assert!(
                        message.contains("of the 766 nodes that its header names: it was cut off"),
                        "{message}"
                    );
                }
                0 => assert!(message.contains("no octree of OctoMap: its first line is \"\""), "{message}"),
                _ => assert!(!matches!(error, OctreeError::CutOff { .. }), "{name} at {length}: {message}"),
            }
        }
    }
}

#[test]
fn a_file_with_changed_bytes_is_refused_or_has_leaves_in_order() {
    let mut state = 1;
    let (mut read, mut refused) = (0, 0);
    for name in ["certain.bt", "measured.ot", "colored.ot"] {
        let bytes = fixture(name);
        for _ in 0..3000 {
            let mut changed = bytes.clone();
            let at = random(&mut state) as usize % changed.len();
            changed[at] ^= 1 << (random(&mut state) % 8);
            match leaves_of(&changed) {
                Ok(leaves) => {
                    read += 1;
                    assert!(leaves.len() <= changed.len() * 8);
                }
                Err(error) => {
                    refused += 1;
                    assert!(error.to_string().len() < 400, "{error}");
                }
            }
        }
    }
    assert!(read > 0 && refused > 0, "{read} read, {refused} refused");
}

#[test]
fn a_claim_of_two_billion_nodes_takes_no_memory_and_is_no_tree() {
    let claims = HEADER.replace("size 17", "size 2147483648");
    let refused = refused(claims.as_bytes());
    assert_eq!(
        refused,
        "the file ends after 0 of the 2147483648 nodes that its header names: it was cut off"
    );
    let beyond = HEADER.replace("size 17", "size 99999999999999999999");
    let problem = leaves_of(beyond.as_bytes()).unwrap_err().to_string();
    assert_eq!(problem, "line 3 of its header: size must be a number of nodes, got \"99999999999999999999\"");
}

#[test]
fn a_tree_deeper_than_any_is_refused() {
    let deep = [HEADER.as_bytes(), &3_u16.to_le_bytes().repeat(40)].concat();
    assert_eq!(refused(&deep), "node 17 lies below the 16 levels that a tree has: the file is damaged");
    let node = [&1.0_f32.to_le_bytes()[..], &[1]].concat();
    let full = HEADER.replace("OcTree binary file", "OcTree file");
    let deep = [full.as_bytes(), &node.repeat(40)].concat();
    assert_eq!(refused(&deep), "node 17 lies below the 16 levels that a tree has: the file is damaged");
}

#[test]
fn sides_of_cells_that_no_map_has_are_refused() {
    for (side, told) in [("nan", "NaN"), ("inf", "inf"), ("-1", "-1"), ("0", "0"), ("1e9", "1000000000")] {
        let bytes = HEADER.replace("0.05", side);
        let message = refused(bytes.as_bytes());
        assert_eq!(message, format!("cells of {told} m (res): those of a map are 0.001 to 100 m"));
    }
    let message = refused(HEADER.replace("0.05", "five").as_bytes());
    assert_eq!(message, "line 4 of its header: res must be a number of meters, got \"five\"");
}

#[test]
fn log_odds_that_are_not_a_number_are_refused() {
    let header = HEADER.replace("OcTree binary file", "OcTree file").replace("size 17", "size 1");
    let bytes = [header.as_bytes(), &f32::NAN.to_le_bytes(), &[0]].concat();
    assert_eq!(refused(&bytes), "the log-odds of node 1 are not a number: the file is damaged");
}

#[test]
fn what_a_header_lacks_or_says_wrongly_is_named() {
    for keyword in ["id", "size", "res", "data"] {
        let lines = HEADER.lines().filter(|line| !line.starts_with(keyword));
        let without: String = lines.map(|line| format!("{line}\n")).collect();
        assert_eq!(refused(without.as_bytes()), format!("its header has no line {keyword:?}"));
    }
    let counting = HEADER.replace("id OcTree", "id CountingOcTree");
    assert!(refused(counting.as_bytes()).starts_with("a tree of type CountingOcTree: OcTree, "));
    assert!(
        refused(b"ply\nformat ascii 1.0\n").starts_with("no octree of OctoMap: its first line is \"ply\"")
    );
    // A file without lines is not read to its end.
    let endless = vec![b'#'; 10 << 20];
    assert!(refused(&endless).len() < 300);
    let comments = [b"# Octomap OcTree file\n".to_vec(), b"#\n".repeat(1 << 20)].concat();
    assert_eq!(refused(&comments), "its header has no line \"data\"");
}

#[test]
fn a_tree_of_another_size_and_what_follows_a_tree_are_refused() {
    let bytes = fixture("certain.bt");
    let text = String::from_utf8_lossy(&bytes).into_owned();
    assert!(text.contains("size 766\n"));
    let at = bytes.windows(3).position(|window| window == b"766").unwrap();
    let mut other = bytes.clone();
    other[at + 2] = b'7';
    assert_eq!(refused(&other), "its header names 767 nodes, and the tree has 766: the file is damaged");
    let appended = [&bytes[..], &bytes].concat();
    assert!(refused(&appended).starts_with("more follows the tree, which ends at byte 1265"));
}

#[test]
fn after_an_error_nothing_more_is_read() {
    let deep = [HEADER.as_bytes(), &3_u16.to_le_bytes().repeat(40)].concat();
    let mut reader = OctreeReader::new(&deep[..]).unwrap();
    assert!(reader.next_leaf().is_err());
    assert_eq!(reader.next_leaf().unwrap(), None::<Leaf>);
}

#[test]
fn a_leaf_of_more_voxels_than_are_made_is_refused_before_they_are() {
    let mut bytes = b"# Octomap OcTree file\nid OcTree\nsize 1\nres 1\ndata\n".to_vec();
    bytes.extend(3.0_f32.to_le_bytes());
    bytes.push(0);
    let read = |coarser| OctreeVoxels::read(&mut OctreeReader::new(&bytes[..]).unwrap(), coarser, |_| {});
    let refused = read(0).unwrap_err().to_string();
    assert!(
        refused.contains("more than 268435456 voxels, the limit: take coarser ones by --resolution"),
        "{refused}"
    );
    assert_eq!(read(15).unwrap().voxels.len(), 8);
}
