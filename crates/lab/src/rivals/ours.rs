//! The structures of this crate's map.

use super::structure::Structure;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::lookup::{self, Lookup};
use mrol_map::map::{MapView, MultiResolutionMap};
use mrol_map::voxel::LatticeFromPoints;

/// A level of a map, queried as users do: through the sharded map and its locks.
#[derive(Debug)]
pub struct ThroughMap<'a> {
    map: &'a MultiResolutionMap,
    level: u32,
    lookup: Lookup,
}

/// Number of points of one query, for which the locks are taken once: what a spinning sensor sends in a tenth of a
/// revolution.
const QUESTION_POINTS: usize = 10_240;
const _: () = assert!(QUESTION_POINTS.is_multiple_of(64), "a question's answers are whole words");

impl<'a> ThroughMap<'a> {
    /// Queries `level` of `map` by `lookup`.
    pub fn new(map: &'a MultiResolutionMap, level: u32, lookup: Lookup) -> Self {
        Self { map, level, lookup }
    }
}

impl Structure for ThroughMap<'_> {
    fn occupied(&self, points: &[Point], map_from_points: &Pose, occupied: &mut [u64]) {
        let quantize = self.map.lattice().from_points(map_from_points);
        for (points, words) in points.chunks(QUESTION_POINTS).zip(occupied.chunks_mut(QUESTION_POINTS / 64)) {
            let view = self.map.view_of(points, map_from_points);
            view.query(points, &quantize, self.level, self.lookup, words);
        }
    }

    fn bytes(&self) -> usize {
        bytes(self.map, self.level, self.lookup)
    }
}

/// A level of a map, locked once for all points of a query: the kernel alone.
#[derive(Debug)]
pub struct Kernel<'a> {
    map: &'a MultiResolutionMap,
    level: u32,
    lookup: Lookup,
}

impl<'a> Kernel<'a> {
    /// Queries `level` of `map` by `lookup`.
    pub fn new(map: &'a MultiResolutionMap, level: u32, lookup: Lookup) -> Self {
        Self { map, level, lookup }
    }
}

impl Structure for Kernel<'_> {
    fn occupied(&self, points: &[Point], map_from_points: &Pose, occupied: &mut [u64]) {
        let quantize = self.map.lattice().from_points(map_from_points);
        let view = self.map.view();
        view.query(points, &quantize, self.level, self.lookup, occupied);
    }

    fn bytes(&self) -> usize {
        bytes(self.map, self.level, self.lookup)
    }
}

/// The reference implementation of [`MapView::query`], which CPUs without SIMD instructions run.
///
/// # Panics
/// When `occupied` is not one word for each 64 points.
pub fn query_scalar(
    view: &MapView<'_>,
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    level: u32,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    lookup::occupied_scalar(points, lattice_from_points, &view.level_view(level), lookup, occupied)
}

/// Looks up packed keys in the filter of `level` alone, which must be there: key i is bit i % 64 of `occupied[i / 64]`.
///
/// # Panics
/// When `occupied` is not one word for each 64 keys.
pub fn filter_contains(view: &MapView<'_>, keys: &[u64], level: u32, occupied: &mut [u64]) {
    lookup::filter_contains(keys, &view.level_view(level), occupied);
}

/// Bytes of the structure that answers. For a filter those of its plane and counters; for the exact set those of the
/// tables of all levels, since three levels share one table.
fn bytes(map: &MultiResolutionMap, level: u32, lookup: Lookup) -> usize {
    let described = map.describe(0, 0);
    match lookup {
        Lookup::Exact => described.set_bytes,
        Lookup::Bloom => {
            described.levels[level as usize].filter.map_or(described.set_bytes, |filter| filter.bytes())
        }
    }
}
