//! The paper's own counting Bloom filter (IV).

use super::structure::{Structure, occupied_by_key, voxels};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::MultiResolutionMap;
use mrol_map::voxel::Lattice;
use mrol_map::voxel::quantize::NO_KEY;

/// Number of counters, one byte each: "the Bloom filter used two hash functions and had 6 million elements" (IV).
const COUNTERS: u64 = 6_000_000;
/// Constant of `djbhash(i)`: h = 5381, t = h * 33 modulo 2^32, t ^ i.
const DJB: u64 = (5381 * 33) & 0xffff_ffff;
/// Constant of `fnvhash(i)`: h = 2166136261, t = h * 16777619 modulo 2^32, t ^ i.
const FNV: u64 = (2_166_136_261 * 16_777_619) & 0xffff_ffff;

/// The paper's counting Bloom filter: six million counters, of which each key increments two.
#[derive(Debug)]
pub struct PaperFilter {
    counters: Vec<u8>,
    lattice: Lattice,
    level: u32,
}

impl PaperFilter {
    /// Builds the filter of the occupied voxels of `level` of a map.
    pub fn of(map: &MultiResolutionMap, level: u32) -> Self {
        let mut counters = vec![0u8; COUNTERS as usize];
        for place in voxels(&map.view(), level).flat_map(|voxel| places(voxel.to_bits())) {
            counters[place] = counters[place].saturating_add(1);
        }
        Self { counters, lattice: *map.lattice(), level }
    }
}

/// Indices of the two counters of a key.
#[inline(always)]
fn places(key: u64) -> [usize; 2] {
    let i = repacked(key);
    [DJB, FNV].map(|t| ((t ^ i) % COUNTERS) as usize)
}

/// Packs three indices as the paper does, "as four 2 byte integers (with one zero filler)" (II-B): its hashes spread
/// these far better than indices of 21 bits. Indices beyond 2 bytes wrap, which can only add false positives.
#[inline(always)]
fn repacked(key: u64) -> u64 {
    key & 0xffff | (key >> 21 & 0xffff) << 16 | (key >> 42 & 0xffff) << 32
}

impl Structure for PaperFilter {
    fn occupied(&self, points: &[Point], map_from_points: &Pose, occupied: &mut [u64]) {
        let quantize = self.lattice.from_points(map_from_points);
        // Both are read in any case: a branch that is mispredicted half the time would cost more.
        occupied_by_key(points, &quantize, self.level, occupied, |key| {
            let [a, b] = places(key).map(|place| self.counters[place] != 0);
            a & b & (key != NO_KEY)
        });
    }

    fn bytes(&self) -> usize {
        self.counters.len()
    }
}

#[cfg(test)]
mod tests {
    use super::COUNTERS;
    use crate::measure::lookup::compare;
    use crate::rivals::structure_name::StructureName;
    use crate::workload::{Order, Scatter, Workload};
    use mrol_map::bloom::ideal_false_positive_rate;
    use mrol_map::map::MapSettings;

    #[test]
    fn false_positives_are_about_as_many_as_equation_1_says() {
        let scatter = Workload::Scatter(Scatter::of(Scatter::VOXELS, 1));
        let map = scatter.map(MapSettings::new(scatter.resolution_m(), 1)).unwrap();
        let filter = StructureName::Paper.build(&map, 0).unwrap();
        let queries = scatter.queries(Order::Random, 500_000, 2);
        let measured = compare(&[(StructureName::Paper, filter)], &map, 0, &queries, 1).unwrap().remove(0);
        let absent = measured.points - (measured.occupied - measured.false_positives);
        let ratio = measured.false_positives as f64
            / absent as f64
            / ideal_false_positive_rate(Scatter::VOXELS, COUNTERS as usize, 2);
        assert!((0.5..1.5).contains(&ratio), "{ratio} of the rate by eq. (1)");
    }
}
