//! The look-up of points, a word at a time.

use super::bloom::Bloom;
use super::exact::Exact;
use super::kernel::{LookupKernel, WORD};
use super::locate::Locator;
use crate::geometry::Point;
use crate::map::lookup::level_view::{LevelView, Lookup};
use crate::util::cpu::Avx512;
use crate::util::prefetch;
use crate::voxel::LatticeFromPoints;
use crate::voxel::quantize::avx512::LANES;

/// See `lookup::occupied`.
pub(in crate::map::lookup) fn occupied(
    _: Avx512,
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    let far = view.bytes(lookup) > NEAR_BYTES;
    // SAFETY: the token says that the CPU has the features; `occupied` holds a bit a point (asserted by our caller).
    unsafe {
        match (lookup, view.hashes, far) {
            (Lookup::Exact, _, false) => {
                run_near::<Exact<false>>(points, lattice_from_points, view, occupied)
            }
            (Lookup::Exact, _, true) => run_far::<Exact<true>>(points, lattice_from_points, view, occupied),
            (Lookup::Bloom, 2, false) => {
                run_near::<Bloom<2, false>>(points, lattice_from_points, view, occupied)
            }
            (Lookup::Bloom, 2, true) => {
                run_far::<Bloom<2, true>>(points, lattice_from_points, view, occupied)
            }
            (Lookup::Bloom, _, _) => run_far::<Bloom<0, true>>(points, lattice_from_points, view, occupied),
        }
    }
}

/// Structures up to this size are taken to lie in the core's own caches, where a prefetch only costs.
const NEAR_BYTES: usize = 1 << 20;

/// Answers for the points of each word as soon as they are located.
///
/// # Safety
/// Needs AVX-512 F, BW, DQ and CD, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
unsafe fn run_near<P: LookupKernel>(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    occupied: &mut [u64],
) -> bool {
    // SAFETY: the features are there, and the view lives.
    unsafe {
        let mut steps = Steps::<P>::load(lattice_from_points, view);
        let (mut word, mut all_have_a_voxel) = (Word::of(P::NO_WORD), true);
        for (answers, points) in occupied.iter_mut().zip(points.chunks(WORD)) {
            steps.locate(points, &mut word);
            all_have_a_voxel &= word.all_have_a_voxel;
            *answers = steps.answer(&word);
        }
        all_have_a_voxel
    }
}

/// Seeks the points of each word [`LookupKernel::AHEAD`] words before it answers for them.
///
/// # Safety
/// Needs AVX-512 F, BW, DQ and CD, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
unsafe fn run_far<P: LookupKernel>(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    occupied: &mut [u64],
) -> bool {
    const PLACES: usize = 4;
    const { assert!(P::AHEAD < PLACES) };
    // SAFETY: the features are there, and the view lives. What is answered for was located before.
    unsafe {
        let mut steps = Steps::<P>::load(lattice_from_points, view);
        let mut under_way = [const { Word::of(P::NO_WORD) }; PLACES];
        let mut words = points.chunks(WORD).enumerate();
        let mut all_have_a_voxel = true;
        let mut locate_next = |steps: &mut Steps<'_, P>, under_way: &mut [Word<P::Word>; PLACES]| {
            if let Some((i, points)) = words.next() {
                let word = &mut under_way[i % PLACES];
                steps.locate(points, word);
                all_have_a_voxel &= word.all_have_a_voxel;
            }
        };
        (0..P::AHEAD).for_each(|_| locate_next(&mut steps, &mut under_way));
        for (i, answers) in occupied.iter_mut().enumerate() {
            locate_next(&mut steps, &mut under_way);
            *answers = steps.answer(&under_way[i % PLACES]);
        }
        all_have_a_voxel
    }
}

/// Where to look for the points of a word.
struct Word<W> {
    voxels: W,
    /// A bit for each point that has a voxel.
    has_voxel: u64,
    all_have_a_voxel: bool,
}

impl<W> Word<W> {
    const fn of(voxels: W) -> Self {
        Self { voxels, has_voxel: 0, all_have_a_voxel: false }
    }
}

/// The steps of a look-up, and what they keep in registers.
struct Steps<'a, P: LookupKernel> {
    locator: Locator,
    registers: P::Registers<'a>,
    memory: P::Memory,
}

impl<'a, P: LookupKernel> Steps<'a, P> {
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn load(lattice_from_points: &LatticeFromPoints, view: &'a LevelView<'_>) -> Self {
        let memory = P::Memory::default();
        // SAFETY: the features are there.
        unsafe {
            Self { locator: Locator::load(lattice_from_points, view), registers: P::load(view), memory }
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn locate(&mut self, points: &[Point], word: &mut Word<P::Word>) {
        prefetch_points(points);
        let padded;
        let (points, present) = match points.first_chunk() {
            Some(points) => (points, u64::MAX),
            None => {
                padded = to_word(points);
                (&padded, (1 << points.len()) - 1)
            }
        };
        let groups = points.as_chunks::<LANES>().0;
        let (mut has_voxel, mut group) = (0, 0);
        let mut locate = |points: &[Point; LANES]| {
            // SAFETY: the features are there, and the view lives.
            unsafe {
                let (index, shard, valid) = self.locator.locate(points);
                has_voxel |= u64::from(valid) << (group * LANES);
                group += 1;
                P::locate(&self.registers, index, shard, valid)
            }
        };
        let located = [locate(&groups[0]), locate(&groups[1]), locate(&groups[2]), locate(&groups[3])];
        // SAFETY: as for this function.
        unsafe { P::seek(&self.registers, &mut self.memory, located, &mut word.voxels) };
        word.has_voxel = has_voxel & present;
        word.all_have_a_voxel = word.has_voxel == present;
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512cd,popcnt")]
    unsafe fn answer(&mut self, word: &Word<P::Word>) -> u64 {
        // SAFETY: as for this function.
        unsafe { P::answer(&self.registers, &mut self.memory, &word.voxels) & word.has_voxel }
    }
}

/// Bytes ahead of the points under way that points are fetched.
const POINTS_AHEAD: usize = 2048;

/// Points come one after another, which the machine foresees, but not from afar enough.
#[inline(always)]
fn prefetch_points(points: &[Point]) {
    let ahead = points.as_ptr().cast::<i8>().wrapping_add(POINTS_AHEAD);
    for line in 0..size_of::<[Point; WORD]>() / 64 {
        prefetch(ahead.wrapping_add(64 * line));
    }
}

/// The last points, which are fewer than a word has bits, and origins.
#[cold]
fn to_word(points: &[Point]) -> [Point; WORD] {
    let mut word = [Point::new(0.0, 0.0, 0.0); WORD];
    word[..points.len()].copy_from_slice(points);
    word
}
