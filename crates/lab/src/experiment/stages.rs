//! Experiment 1 of the paper: the durations of the stages of a look-up (IV-A, Fig. 1).

use std::hint::black_box;

use crate::measure::stopwatch::Runs;
use crate::rivals::{Dense, DenseTooLarge, HashSet, Kernel, Structure, bits, filter_contains};
use crate::workload::Queries;
use mrol_map::map::Lookup;
use mrol_map::map::MultiResolutionMap;
use mrol_map::voxel::LatticeFromPoints;
use mrol_map::voxel::quantize;

/// A stage of a look-up, with its durations.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Name of the stage, as in the figure.
    pub name: &'static str,
    /// Durations run by run, nanoseconds a point.
    pub runs: Runs,
}

/// The stages of Fig. 1 from bottom to top, and the whole look-up in the dense array, which the figure leaves out.
pub const STAGES: [&str; 8] = [
    "look-up: Bloom filter",
    "look-up: dense array",
    "look-up: hash table",
    "look-up: set intersection",
    "rotate, translate, quantize",
    "transform and look-up: Bloom filter",
    "transform and look-up: dense array",
    "transform and look-up: hash table",
];

/// Times each stage `runs` times on level 0 of `map`, each after a run that is not timed. The stages take turns.
///
/// # Errors
/// When a dense array of the map would be too large.
pub fn measure(
    map: &MultiResolutionMap,
    queries: &Queries,
    runs: usize,
) -> Result<Vec<Stage>, DenseTooLarge> {
    let mut bench = Bench::new(map, queries)?;
    let mut measured = STAGES.map(|name| Stage { name, runs: Runs::default() });
    for _ in 0..runs {
        for (stage, measured) in measured.iter_mut().enumerate() {
            // An untimed run first, so that what other stages left in the caches does not count.
            bench.run(stage, &mut Runs::default());
            bench.run(stage, &mut measured.runs);
        }
    }
    Ok(measured.into())
}

/// Inputs of the stages, prepared before the timing.
struct Bench<'a> {
    queries: &'a Queries,
    quantize: LatticeFromPoints,
    map: &'a MultiResolutionMap,
    filter: Kernel<'a>,
    dense: Dense,
    set: HashSet,
    /// Keys of all points, the input of the look-ups alone.
    keys: Vec<u64>,
    offsets: Vec<u32>,
    occupied: Vec<u64>,
}

impl<'a> Bench<'a> {
    fn new(map: &'a MultiResolutionMap, queries: &'a Queries) -> Result<Self, DenseTooLarge> {
        let (points, quantize) = (&queries.points, map.lattice().from_points(&queries.map_from_points));
        let dense = Dense::of(map, 0)?;
        let (mut keys, mut offsets) = (vec![0; points.len()], vec![0; points.len()]);
        quantize::keys(points, &quantize, 0, &mut keys);
        crate::rivals::offsets(points, &quantize, 0, dense.grid(), &mut offsets);
        Ok(Self {
            queries,
            quantize,
            map,
            filter: Kernel::new(map, 0, Lookup::Bloom),
            dense,
            set: HashSet::of(map, 0),
            keys,
            offsets,
            occupied: vec![0; points.len().div_ceil(64)],
        })
    }

    /// Runs and times the stage with that index in [`STAGES`].
    fn run(&mut self, stage: usize, runs: &mut Runs) {
        let points = self.queries.points.len();
        runs.time(points, || match stage {
            0 => filter_contains(&self.map.view(), &self.keys, 0, &mut self.occupied),
            1 => self.dense.contains(&self.offsets, &mut self.occupied),
            2 => bits(&self.keys, &mut self.occupied, |key| self.set.keys().contains(key)),
            3 => drop(black_box(self.intersection())),
            4 => self.transform(),
            5 => ask(&self.filter, self.queries, &mut self.occupied),
            6 => ask(&self.dense, self.queries, &mut self.occupied),
            _ => ask(&self.set, self.queries, &mut self.occupied),
        });
    }

    /// The overlap as in the paper's first implementation: the intersection of the set of the scan's voxels with that
    /// of the map.
    fn intersection(&self) -> usize {
        let scan: hashbrown::HashSet<u64> = self.keys.iter().copied().collect();
        scan.intersection(self.set.keys()).count()
    }

    /// Computes the keys in batches of a thousand points, which stay in the innermost cache.
    fn transform(&self) {
        let mut keys = [0; 1024];
        for points in self.queries.points.chunks(keys.len()) {
            quantize::keys(points, &self.quantize, 0, &mut keys[..points.len()]);
            black_box(&mut keys);
        }
    }
}

fn ask(structure: &impl Structure, queries: &Queries, occupied: &mut [u64]) {
    structure.occupied(&queries.points, &queries.map_from_points, occupied);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Order, Scatter, Workload};
    use mrol_map::map::MapSettings;

    #[test]
    fn every_stage_is_timed_as_often_as_wished() {
        let scatter = Workload::Scatter(Scatter::of(3000, 1));
        let map = scatter.map(MapSettings::new(scatter.resolution_m(), 1)).unwrap();
        let stages = measure(&map, &scatter.queries(Order::Random, 1000, 1), 3).unwrap();
        assert!(stages.iter().map(|stage| stage.name).eq(STAGES));
        assert!(stages.iter().all(|stage| stage.runs.ns_per_item().len() == 3 && stage.runs.median() > 0.0));
    }
}
