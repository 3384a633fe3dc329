//! What OctoMap makes of the same scans.
//!
//! `crates/lab/benches/peers/octomap_free_space.cpp` reads the files and writes the states; their layouts are in
//! `crates/lab/src/experiment/free_space.rs`.

use std::collections::BTreeSet;
use std::path::PathBuf;

use mrol_map::geometry::{Point, Pose};
use mrol_map::voxel::VoxelKey;

use crate::scenes::Situation;

/// Where the peer's map ends, of a sensor without a range, meters.
const RANGE_M: f64 = 30.0;
/// Bytes before the voxels of a file of states, and of a voxel.
const HEAD_BYTES: usize = 24;
const STATE_BYTES: usize = 13;

/// How many of some voxels the peer calls free, and occupied; nothing where nobody asks for it. Writes the scans.
pub(crate) fn states(
    situation: &Situation,
    scans: &[(Vec<Point>, Pose)],
    asked: &BTreeSet<VoxelKey>,
) -> [usize; 2] {
    let Some(folder) = std::env::var_os("MROL_PEER_DIR").map(PathBuf::from) else { return [0, 0] };
    let name = format!("{:?}-{}", situation.kind, situation.seed);
    let no_return_m = situation.filter.no_return_m.map(|no_return_m| no_return_m - 0.1);
    let range_m = situation.filter.range_max_m.or(no_return_m).unwrap_or(RANGE_M);
    std::fs::write(folder.join(format!("{name}.scans")), bytes_of(situation.resolution_m, range_m, scans))
        .unwrap();
    let Ok(bytes) = std::fs::read(folder.join(format!("{name}.states"))) else { return [0, 0] };
    let mut counts = [0, 0];
    for state in bytes[HEAD_BYTES..].as_chunks::<STATE_BYTES>().0 {
        let along = |axis: usize| i32::from_le_bytes(std::array::from_fn(|i| state[axis * 4 + i]));
        let voxel = VoxelKey::new([along(0), along(1), along(2)]).unwrap();
        counts[usize::from(state[12])] += usize::from(asked.contains(&voxel));
    }
    counts
}

fn bytes_of(resolution_m: f64, range_m: f64, scans: &[(Vec<Point>, Pose)]) -> Vec<u8> {
    let mut bytes = b"mrolscan".to_vec();
    bytes.extend([resolution_m, range_m].iter().flat_map(|number| number.to_le_bytes()));
    bytes.extend((scans.len() as u64).to_le_bytes());
    for (points, map_from_sensor) in scans {
        let mut put = |place: [f64; 3]| bytes.extend(place.iter().flat_map(|&c| (c as f32).to_le_bytes()));
        put(map_from_sensor.translation.vector.into());
        bytes.extend((points.len() as u64).to_le_bytes());
        for point in points {
            let in_map: [f64; 3] = (map_from_sensor * point.to_f64()).into();
            bytes.extend(in_map.iter().flat_map(|&c| (c as f32).to_le_bytes()));
        }
    }
    bytes
}
