//! The steps in which the kernels of a look-up answer for a word of points.

use std::arch::x86_64::*;

use crate::map::lookup::level_view::LevelView;
use crate::voxel::quantize::avx512::LANES;

/// Points of a word of answers, and sixteens of them.
pub(super) const WORD: usize = 64;

pub(super) const GROUPS: usize = WORD / LANES;

/// How the voxels of a word of points are looked up: where to look, which may start the fetch, and what is there.
///
/// Each probe has one runner, and each step of it one caller: so all of them become one loop.
pub(super) trait LookupKernel {
    /// What the probe keeps in registers.
    type Registers<'a>;
    /// Sixteen voxels on their way.
    type Located;
    /// Where to look for a word of voxels.
    type Word;
    /// What is known from the word before.
    type Memory: Default;

    /// What a word is before it is sought.
    const NO_WORD: Self::Word;

    /// Words that are sought ahead where the structure is large, so that many cache misses are under way; out-of-order
    /// execution alone reaches over two or three groups of sixteen points.
    const AHEAD: usize;

    /// # Safety
    /// Needs AVX-512 F, BW, DQ and CD.
    unsafe fn load<'a>(view: &'a LevelView<'_>) -> Self::Registers<'a>;

    /// Takes up sixteen voxels of the view's level. Those that are none are not `valid`, and what is answered of them
    /// does not count.
    ///
    /// # Safety
    /// Needs AVX-512 F, BW, DQ and CD; the view must still live.
    unsafe fn locate(
        r: &Self::Registers<'_>,
        index: [__m512i; 3],
        shard: __m512i,
        valid: u16,
    ) -> Self::Located;

    /// Finds out where to look for a whole word. Words come in their order.
    ///
    /// # Safety
    /// As for `locate`.
    unsafe fn seek(
        r: &Self::Registers<'_>,
        memory: &mut Self::Memory,
        located: [Self::Located; GROUPS],
        word: &mut Self::Word,
    );

    /// A bit for each of the voxels: is it occupied? Words come in their order.
    ///
    /// # Safety
    /// As for `locate`; the word was sought.
    unsafe fn answer(r: &Self::Registers<'_>, memory: &mut Self::Memory, word: &Self::Word) -> u64;
}
