//! The look-up sixteen points at a time, for machines with AVX-512 F, DQ and CD.
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
use std::mem::MaybeUninit;

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
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512cd")
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

/// Words whose points are located ahead where the structure is larger: some hundred cache misses are under way. Out-of-order execution alone
/// reaches over two or three groups of sixteen points.
const AHEAD: usize = 2;

/// How the voxels of sixteen points are looked up: where to look, which may start the fetch, and what is there.
trait Probe {
    /// What the probe keeps in registers.
    type Registers<'a>;
    /// Where to look.
    type Located;

    /// # Safety
    /// Needs AVX-512 F, DQ and CD.
    unsafe fn load<'a>(view: &'a LevelView<'_>) -> Self::Registers<'a>;

    /// Computes where to look for sixteen voxels of the view's level, and with `FETCH` starts fetching that.
    ///
    /// # Safety
    /// Needs AVX-512 F, DQ and CD; the view must still live.
    unsafe fn locate<const FETCH: bool>(
        r: &Self::Registers<'_>,
        index: [__m512i; 3],
        shard: __m512i,
    ) -> Self::Located;

    /// A bit for each of the sixteen: is it occupied?
    ///
    /// # Safety
    /// Needs AVX-512 F, DQ and CD; the view must still live.
    unsafe fn answer(r: &Self::Registers<'_>, located: &Self::Located) -> u16;
}

/// Points of a word of answers, and sixteens of them.
const WORD: usize = 64;
const GROUPS: usize = WORD / LANES;

/// Answers for the points of each word as soon as they are located.
///
/// # Safety
/// Needs AVX-512 F, DQ and CD, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx512f,avx512dq,avx512cd")]
unsafe fn run_near<P: Probe>(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    occupied: &mut [u64],
) -> bool {
    // SAFETY: the features are there, and the view lives.
    unsafe {
        let steps = Steps::<P, false>::load(lattice_from_points, view);
        let mut all_have_a_voxel = true;
        for (word, points) in occupied.iter_mut().zip(points.chunks(WORD)) {
            let located = steps.locate(points);
            all_have_a_voxel &= located.all_have_a_voxel;
            *word = steps.answer(&located);
        }
        all_have_a_voxel
    }
}

/// Locates the points of each word [`AHEAD`] words before it answers for them.
///
/// # Safety
/// Needs AVX-512 F, DQ and CD, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx512f,avx512dq,avx512cd")]
unsafe fn run_far<P: Probe>(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    occupied: &mut [u64],
) -> bool {
    const PLACES: usize = AHEAD + 1;
    // SAFETY: the features are there, and the view lives. What is answered for was located before.
    unsafe {
        let steps = Steps::<P, true>::load(lattice_from_points, view);
        let mut under_way = [const { MaybeUninit::<Word<P::Located>>::uninit() }; PLACES];
        let mut words = points.chunks(WORD).enumerate();
        let mut all_have_a_voxel = true;
        let mut locate_next = |under_way: &mut [MaybeUninit<Word<P::Located>>; PLACES]| {
            if let Some((i, points)) = words.next() {
                let located = under_way[i % PLACES].write(steps.locate(points));
                all_have_a_voxel &= located.all_have_a_voxel;
            }
        };
        (0..AHEAD).for_each(|_| locate_next(&mut under_way));
        for (i, word) in occupied.iter_mut().enumerate() {
            locate_next(&mut under_way);
            *word = steps.answer(under_way[i % PLACES].assume_init_ref());
        }
        all_have_a_voxel
    }
}

/// Where to look for the points of a word.
struct Word<L> {
    located: [L; GROUPS],
    /// A bit for each point that has a voxel.
    has_voxel: u64,
    all_have_a_voxel: bool,
}

/// The steps of a look-up, and what they keep in registers.
struct Steps<'a, P: Probe, const FETCH: bool> {
    place: Place,
    registers: P::Registers<'a>,
}

impl<'a, P: Probe, const FETCH: bool> Steps<'a, P, FETCH> {
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd")]
    unsafe fn load(lattice_from_points: &LatticeFromPoints, view: &'a LevelView<'_>) -> Self {
        // SAFETY: the features are there.
        unsafe { Self { place: Place::load(lattice_from_points, view), registers: P::load(view) } }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd")]
    unsafe fn locate(&self, points: &[Point]) -> Word<P::Located> {
        let Some(points) = points.first_chunk::<WORD>() else {
            // SAFETY: as for this function.
            return unsafe { self.locate_last(points) };
        };
        let (mut has_voxel, mut group) = (0, 0);
        let groups = points.as_chunks::<LANES>().0;
        let mut locate = |points: &[Point; LANES]| {
            // SAFETY: the features are there, and the view lives.
            unsafe {
                let (index, shard, valid) = self.place.of(points);
                has_voxel |= u64::from(valid) << (group * LANES);
                group += 1;
                P::locate::<FETCH>(&self.registers, index, shard)
            }
        };
        let located = [locate(&groups[0]), locate(&groups[1]), locate(&groups[2]), locate(&groups[3])];
        Word { located, has_voxel, all_have_a_voxel: has_voxel == u64::MAX }
    }

    /// The same for fewer points than a word has bits.
    #[cold]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd")]
    unsafe fn locate_last(&self, points: &[Point]) -> Word<P::Located> {
        let mut padded = [Point::new(0.0, 0.0, 0.0); WORD];
        padded[..points.len()].copy_from_slice(points);
        // SAFETY: as for this function.
        let word = unsafe { self.locate(&padded) };
        let present = (1 << points.len()) - 1;
        let has_voxel = word.has_voxel & present;
        Word { has_voxel, all_have_a_voxel: has_voxel == present, ..word }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512cd")]
    unsafe fn answer(&self, word: &Word<P::Located>) -> u64 {
        // SAFETY: as for this function.
        let answer = |group: usize| unsafe {
            u64::from(P::answer(&self.registers, &word.located[group])) << (group * LANES)
        };
        (answer(0) | answer(1) | answer(2) | answer(3)) & word.has_voxel
    }
}
