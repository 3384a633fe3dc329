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

/// Points of a word of answers, and sixteens of them.
const WORD: usize = 64;
const GROUPS: usize = WORD / LANES;

/// Takes all steps of a word's points one after the other, each step of all of them together.
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
    // SAFETY: the features are there, and the view lives.
    unsafe {
        let steps = Steps::<P>::load(lattice_from_points, view);
        let mut all_have_a_voxel = true;
        for (word, points) in occupied.iter_mut().zip(points.chunks(WORD)) {
            let located = steps.locate::<false>(points);
            all_have_a_voxel &= located.all_have_a_voxel;
            *word = steps.answer(steps.find::<false>(located));
        }
        all_have_a_voxel
    }
}

/// Takes the steps of different words' points in turn.
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
    // SAFETY: the features are there, and the view lives.
    unsafe {
        let steps = Steps::<P>::load(lattice_from_points, view);
        let mut all_have_a_voxel = true;
        let mut locate = |points| {
            let located = steps.locate::<true>(points);
            all_have_a_voxel &= located.all_have_a_voxel;
            located
        };
        let mut words = points.chunks(WORD);
        let mut found = words.next().map(|points| steps.find::<true>(locate(points)));
        let mut located = words.next().map(&mut locate);
        for word in occupied {
            let Some(ready) = found else { break };
            let next = words.next().map(&mut locate);
            found = located.map(|located| steps.find::<true>(located));
            located = next;
            *word = steps.answer(ready);
        }
        all_have_a_voxel
    }
}

/// The steps of the points of a word.
struct Steps<'a, P: Probe> {
    place: Place,
    registers: P::Registers<'a>,
}

/// A step's outcome for the points of a word.
struct Word<T> {
    of: [T; GROUPS],
    /// A bit for each point that has a voxel.
    has_voxel: u64,
    all_have_a_voxel: bool,
}

impl<'a, P: Probe> Steps<'a, P> {
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn load(lattice_from_points: &LatticeFromPoints, view: &'a LevelView<'_>) -> Self {
        // SAFETY: the features are there.
        unsafe { Self { place: Place::load(lattice_from_points, view), registers: P::load(view) } }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn locate<const FAR: bool>(&self, points: &[Point]) -> Word<P::Located> {
        let Some(points) = points.first_chunk::<WORD>() else {
            // SAFETY: as for this function.
            return unsafe { self.locate_last::<FAR>(points) };
        };
        let (mut has_voxel, mut group) = (0, 0);
        let of = points.as_chunks::<LANES>().0;
        let mut locate = |points: &[Point; LANES]| {
            // SAFETY: the features are there.
            unsafe {
                let (index, shard, valid) = self.place.of(points);
                has_voxel |= u64::from(valid) << (group * LANES);
                group += 1;
                P::locate::<FAR>(&self.registers, index, shard)
            }
        };
        let of = [locate(&of[0]), locate(&of[1]), locate(&of[2]), locate(&of[3])];
        Word { of, has_voxel, all_have_a_voxel: has_voxel == u64::MAX }
    }

    /// The same for fewer points than a word has bits.
    #[cold]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn locate_last<const FAR: bool>(&self, points: &[Point]) -> Word<P::Located> {
        let mut padded = [Point::new(0.0, 0.0, 0.0); WORD];
        padded[..points.len()].copy_from_slice(points);
        let present = (1 << points.len()) - 1;
        // SAFETY: as for this function.
        let word = unsafe { self.locate::<FAR>(&padded) };
        let has_voxel = word.has_voxel & present;
        Word { has_voxel, all_have_a_voxel: has_voxel == present, ..word }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn find<const FAR: bool>(&self, located: Word<P::Located>) -> Word<P::Found> {
        let Word { of: [a, b, c, d], has_voxel, all_have_a_voxel } = located;
        // SAFETY: as for this function.
        let find = |located| unsafe { P::find::<FAR>(&self.registers, located) };
        Word { of: [find(a), find(b), find(c), find(d)], has_voxel, all_have_a_voxel }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn answer(&self, found: Word<P::Found>) -> u64 {
        // SAFETY: as for this function.
        let answer = |group: usize| unsafe {
            u64::from(P::answer(&self.registers, found.of[group])) << (group * LANES)
        };
        (answer(0) | answer(1) | answer(2) | answer(3)) & found.has_voxel
    }
}
