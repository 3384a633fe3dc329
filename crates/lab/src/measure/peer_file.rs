//! A file with voxels, queries and answers, for programs of other libraries that are asked the same.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use mrol_map::map::MultiResolutionMap;

/// Its first bytes.
const MAGIC: &[u8; 8] = b"mrolpeer";

/// Writes the finest voxels of `map` and the queries with their answers. All numbers are little-endian:
///
/// ```text
/// "mrolpeer"
/// f64   side of a voxel, meters
/// f64   range of rays, or radius of a search, meters
/// u64   number of voxels, then for each
///       i32 x 3   its index; it is the cube from index * side to (index + 1) * side
/// u64   number of queries, then for each
///       f32 x N   a point x y z (N = 3); a ray: its origin x y z and its direction (N = 6); or the spheres of an arm:
///                 the center x y z and the radius of each (N = 4 * 59); meters
///       f32       the answer: a distance, meters, or infinity
/// ```
///
/// # Errors
/// When the file cannot be written.
pub fn write<const N: usize>(
    path: &Path,
    map: &MultiResolutionMap,
    range_m: f64,
    queries: impl ExactSizeIterator<Item = ([f32; N], f32)>,
) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(MAGIC)?;
    file.write_all(&map.lattice().resolution_m(0).to_le_bytes())?;
    file.write_all(&range_m.to_le_bytes())?;
    let voxels = map.view().voxels();
    file.write_all(&(voxels.len() as u64).to_le_bytes())?;
    for voxel in voxels.iter() {
        voxel.index().iter().try_for_each(|index| file.write_all(&index.to_le_bytes()))?;
    }
    file.write_all(&(queries.len() as u64).to_le_bytes())?;
    for (query, answer) in queries {
        query.iter().chain([&answer]).try_for_each(|number| file.write_all(&number.to_le_bytes()))?;
    }
    file.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::{MapContents, MapSettings};
    use mrol_map::voxel::VoxelKey;

    #[test]
    fn a_file_has_voxels_queries_and_answers() {
        let voxels = [[1, -2, 3]].into_iter().filter_map(VoxelKey::new).collect();
        let map = MultiResolutionMap::restore(MapSettings::new(0.5, 1), MapContents::at(1, voxels)).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("peer");
        write(&path, &map, 9.0, [([1.0, 2.0, 3.0], f32::INFINITY)].into_iter()).unwrap();
        let mut expected = b"mrolpeer".to_vec();
        [0.5f64, 9.0].iter().for_each(|number| expected.extend(number.to_le_bytes()));
        expected.extend(1u64.to_le_bytes());
        [1i32, -2, 3].iter().for_each(|index| expected.extend(index.to_le_bytes()));
        expected.extend(1u64.to_le_bytes());
        [1.0f32, 2.0, 3.0, f32::INFINITY].iter().for_each(|number| expected.extend(number.to_le_bytes()));
        assert_eq!(std::fs::read(&path).unwrap(), expected);
    }
}
