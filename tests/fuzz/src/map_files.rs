//! Maps of other programs.

use std::io::Cursor;

use mrol_files::npz::{NpzContent, NpzReader};
use mrol_files::octree::{CellState, Octree, OctreeReader, OctreeVoxels};

/// Leaves that a node may have.
const LEAVES_A_NODE_MAX: usize = 8;
/// A tree whose voxels are made: a node of few bytes may be a large part of space.
const LEVEL_MAX: u32 = 3;
/// How much smaller than its content a compressed array is, at most.
const COMPRESSED_MAX: usize = 1100;
/// Characters of a message, at most: a hostile file does not fill the log.
const MESSAGE_MAX: usize = 1500;

/// An octree of OctoMap: its leaves come in order, and those that were read are written and read again as they were.
pub(super) fn octree(bytes: &[u8]) {
    let mut reader = match OctreeReader::new(bytes) {
        Ok(reader) => reader,
        Err(error) => return check_message(&error.to_string()),
    };
    let (mut tree, mut levels) = (Octree::default(), 0);
    loop {
        match reader.next_leaf() {
            Ok(Some(leaf)) => {
                levels = levels.max(if leaf.state == CellState::Occupied { leaf.level } else { 0 });
                tree.push(leaf).expect("leaves come in the order of files");
            }
            Ok(None) => break,
            Err(error) => return check_message(&error.to_string()),
        }
    }
    assert!(tree.len() <= bytes.len() * LEAVES_A_NODE_MAX, "{} leaves of {} bytes", tree.len(), bytes.len());
    assert!(reader.position() <= bytes.len() as u64);
    let mut files = [Vec::new(), Vec::new()];
    tree.write_binary(reader.resolution_m(), &mut files[0]).expect("memory");
    tree.write_full(reader.resolution_m(), &mut files[1]).expect("memory");
    for file in files {
        let mut again = OctreeReader::new(&file[..]).expect("what was written");
        assert_eq!(again.resolution_m(), reader.resolution_m());
        for leaf in tree.leaves() {
            assert_eq!(again.next_leaf().expect("what was written"), Some(leaf));
        }
        assert_eq!(again.next_leaf().expect("what was written"), None);
    }
    if levels <= LEVEL_MAX {
        let read = OctreeVoxels::read(&mut OctreeReader::new(bytes).expect("as before"), 0, |_| {});
        match read {
            Ok(read) => assert!(read.voxels.len() as u64 >= read.occupied),
            Err(error) => check_message(&error.to_string()),
        }
    }
}

/// Arrays of numpy: voxels or points, no more than the file has numbers for.
pub(super) fn arrays(bytes: &[u8]) {
    let mut reader = match NpzReader::new(Cursor::new(bytes)) {
        Ok(reader) => reader,
        Err(error) => return check_message(&error.to_string()),
    };
    let _ = reader.bytes();
    let mut count = 0;
    let read = match reader.content {
        NpzContent::Voxels { .. } => reader.read_voxels(0, |_| {}).map(|voxels| count = voxels.len()),
        NpzContent::Points => reader.read_points(|part, _| count += part.len()),
    };
    assert!(count <= bytes.len() * COMPRESSED_MAX, "{count} rows of {} bytes", bytes.len());
    read.err().into_iter().for_each(|error| check_message(&error.to_string()));
}

fn check_message(message: &str) {
    assert!(message.chars().count() < MESSAGE_MAX, "{message}");
}
