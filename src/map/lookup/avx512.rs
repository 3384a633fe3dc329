//! The look-up sixteen points at a time, for machines with AVX-512 F and DQ.
//!
//! Every step is the twin of one of [`super::scalar`]: the same f32 operations in the same order, the same
//! hashes. Shard descriptors stay in registers; the only memory touched a point is its word of the plane (or
//! its key and mask of the table).
#![expect(unsafe_code, reason = "vector intrinsics and gathers from raw addresses")]

mod bloom;
mod exact;
mod place;
mod registers;
pub(super) mod stages;

use std::arch::x86_64::*;

use super::{LevelView, Lookup};
use crate::geometry::Point;
use crate::voxel::LatticeFromPoints;
use bloom::Bloom;
use exact::Exact;
use place::Place;

/// Points a step: one f32 register an axis.
const LANES: usize = 16;

/// True when the machine can run this module.
pub(super) fn is_available() -> bool {
    is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq")
}

/// See [`super::occupied`]. Must only be called where [`is_available`].
pub(super) fn occupied(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    debug_assert!(is_available());
    let far = view.bytes(lookup) > NEAR_BYTES;
    // SAFETY: the caller checked for the features; `occupied` holds a bit a point (asserted by our caller).
    unsafe {
        match (lookup, view.hashes, far) {
            (Lookup::Exact, _, false) => run_near::<Exact>(points, lattice_from_points, view, occupied),
            (Lookup::Exact, _, true) => run_far::<Exact>(points, lattice_from_points, view, occupied),
            (Lookup::Bloom, 2, false) => run_near::<Bloom<2>>(points, lattice_from_points, view, occupied),
            (Lookup::Bloom, 2, true) => run_far::<Bloom<2>>(points, lattice_from_points, view, occupied),
            (Lookup::Bloom, _, _) => run_far::<Bloom<0>>(points, lattice_from_points, view, occupied),
        }
    }
}

/// Structures up to this size are taken to lie in the core's own caches, where a prefetch only costs.
const NEAR_BYTES: usize = 1 << 20;

/// How the voxels of sixteen points are looked up, in steps with at most one cache miss a point each.
///
/// Where the structure is far larger than the caches, [`run_far`] takes the steps of different points in turn, 64
/// points apart, and each step only starts the fetch that the next one needs: some hundred misses are on their
/// way at once. Out-of-order execution alone reaches over two or three groups of sixteen.
trait Probe {
    /// What the probe keeps in registers.
    type Registers<'a>;
    /// Where to look first.
    type Located: Copy;
    /// Where the answers are.
    type Found: Copy;

    /// # Safety
    /// Needs AVX-512 F and DQ.
    unsafe fn load<'a>(view: &'a LevelView<'_>) -> Self::Registers<'a>;

    /// Computes where to look for sixteen voxels of the view's level.
    ///
    /// # Safety
    /// Needs AVX-512 F and DQ.
    unsafe fn locate<const FAR: bool>(
        r: &Self::Registers<'_>,
        index: [__m512i; 3],
        shard: __m512i,
    ) -> Self::Located;

    /// Looks there for where the answers are.
    ///
    /// # Safety
    /// Needs AVX-512 F and DQ; the view must still live.
    unsafe fn find<const FAR: bool>(r: &Self::Registers<'_>, located: Self::Located) -> Self::Found;

    /// A bit for each of the sixteen: is it occupied?
    ///
    /// # Safety
    /// Needs AVX-512 F and DQ; the view must still live.
    unsafe fn answer(r: &Self::Registers<'_>, found: Self::Found) -> u16;
}

/// Sixteens of points in a word of answers.
const GROUPS: usize = 64 / LANES;

/// Takes all steps of sixteen points one after the other.
///
/// # Safety
/// Needs AVX-512 F and DQ, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn run_near<P: Probe>(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    occupied: &mut [u64],
) -> bool {
    // SAFETY: as in `run_far`.
    unsafe {
        let place = Place::load(lattice_from_points, view);
        let r = P::load(view);
        let mut all_have_a_voxel = true;
        for (word, points) in occupied.iter_mut().zip(points.chunks(64)) {
            let mut hits = 0;
            for (group, points) in points.chunks(LANES).enumerate() {
                let (index, shard, valid) = place.of(points);
                let present = ((1u32 << points.len()) - 1) as u16;
                all_have_a_voxel &= valid & present == present;
                let found = P::find::<false>(&r, P::locate::<false>(&r, index, shard));
                hits |= u64::from(P::answer(&r, found) & valid & present) << (group * LANES);
            }
            *word = hits;
        }
        all_have_a_voxel
    }
}

/// Takes the steps of different points in turn.
///
/// # Safety
/// Needs AVX-512 F and DQ, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn run_far<P: Probe>(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    occupied: &mut [u64],
) -> bool {
    // SAFETY: loads stay within `points` or the padded tail; the rest needs only the features.
    unsafe {
        let place = Place::load(lattice_from_points, view);
        let r = P::load(view);
        let mut all_have_a_voxel = true;
        let mut locate = |points: &[Point]| {
            let mut has_voxel = 0;
            let mut located = [None; GROUPS];
            for (group, points) in points.chunks(LANES).enumerate() {
                let (index, shard, valid) = place.of(points);
                let present = ((1u32 << points.len()) - 1) as u16;
                all_have_a_voxel &= valid & present == present;
                has_voxel |= u64::from(valid & present) << (group * LANES);
                located[group] = Some(P::locate::<true>(&r, index, shard));
            }
            (located, has_voxel)
        };
        let find = |(located, has_voxel): ([Option<P::Located>; GROUPS], u64)| {
            let mut found = [None; GROUPS];
            for (found, located) in found.iter_mut().zip(located) {
                if let Some(located) = located {
                    *found = Some(P::find::<true>(&r, located));
                }
            }
            (found, has_voxel)
        };
        let answer = |(found, has_voxel): ([Option<P::Found>; GROUPS], u64)| {
            let mut hits = 0;
            for (group, found) in found.into_iter().enumerate() {
                if let Some(found) = found {
                    hits |= u64::from(P::answer(&r, found)) << (group * LANES);
                }
            }
            hits & has_voxel
        };
        let mut words = points.chunks(64);
        let mut located = words.next().map(&mut locate);
        let mut found = located.take().map(&find);
        located = words.next().map(&mut locate);
        for word in occupied {
            let Some(ready) = found else { break };
            let next = words.next().map(&mut locate);
            found = located.map(&find);
            located = next;
            *word = answer(ready);
        }
        all_have_a_voxel
    }
}
