//! The look-up sixteen points at a time, for machines with AVX-512 F and DQ.
//!
//! Every step is the twin of one of [`super::scalar`]: the same f32 operations in the same order, the same
//! hashes. Shard descriptors stay in registers; the only memory touched a point is its word of the plane (or
//! its key and mask of the table).
#![expect(unsafe_code, reason = "vector intrinsics and gathers from raw addresses")]

use std::arch::x86_64::*;

use super::{LevelView, Lookup};
use crate::bloom::{HASH_A, HASH_B, HASH_C};
use crate::geometry::Point;
use crate::map::sharding::SHARDS;
use crate::voxel::{BLOCK_LEVELS, BlockMask, BlockTable, Cell, LatticeFromPoints, VACANT};

/// Points a step: one f32 register an axis.
const LANES: usize = 16;
const _: () = assert!(
    SHARDS == LANES,
    "descriptors of all shards fill two registers of eight"
);

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
    // SAFETY: the caller checked for the features; `occupied` holds a bit a point (asserted by our caller).
    unsafe {
        match (lookup, view.hashes) {
            (Lookup::Exact, _) => run::<Exact>(points, lattice_from_points, view, occupied),
            (Lookup::Bloom, 2) => run::<Bloom<2>>(points, lattice_from_points, view, occupied),
            (Lookup::Bloom, _) => run::<Bloom<0>>(points, lattice_from_points, view, occupied),
        }
    }
}

/// How the voxels of eight points are looked up.
trait Probe {
    /// What the probe keeps in registers.
    type Registers;

    /// # Safety
    /// Needs AVX-512 F and DQ.
    unsafe fn load(view: &LevelView<'_>) -> Self::Registers;

    /// A bit for each of sixteen voxels of the view's level: is it occupied?
    ///
    /// # Safety
    /// Needs AVX-512 F and DQ; `registers` must come from a view that still lives.
    unsafe fn look_up(registers: &Self::Registers, index: [__m512i; 3], shard: __m512i) -> u16;
}

/// # Safety
/// Needs AVX-512 F and DQ, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn run<P: Probe>(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    occupied: &mut [u64],
) -> bool {
    // SAFETY: loads stay within `points` or the padded tail; the rest needs only the features.
    unsafe {
        let quantise = Quantise::load(lattice_from_points);
        let registers = P::load(view);
        let level = _mm_cvtsi32_si128(view.level as i32);
        let region_shift = _mm_cvtsi32_si128(view.region_shift as i32);
        let mut all_valid = true;
        for (points, word) in points.chunks(64).zip(occupied) {
            let mut bits = 0;
            for (group, points) in points.chunks(LANES).enumerate() {
                let [a, b, c] = load(points);
                let (index, valid) = quantise.index(deinterleave(a, b, c));
                let index = index.map(|i| _mm512_sra_epi32(i, level));
                let shard = shard(index.map(|i| _mm512_sra_epi32(i, region_shift)));
                let present = ((1u32 << points.len()) - 1) as u16;
                all_valid &= valid & present == present;
                let hits = P::look_up(&registers, index, shard) & valid & present;
                bits |= u64::from(hits) << (group * LANES);
            }
            *word = bits;
        }
        all_valid
    }
}

/// The 48 coordinates of up to sixteen points, zeros after the last.
///
/// # Safety
/// Needs AVX-512 F.
#[target_feature(enable = "avx512f")]
unsafe fn load(points: &[Point]) -> [__m512; 3] {
    let mut tail = [Point::new(0.0, 0.0, 0.0); LANES];
    let start = if points.len() == LANES {
        points.as_ptr()
    } else {
        tail[..points.len()].copy_from_slice(points);
        tail.as_ptr()
    };
    // SAFETY: sixteen points are 48 f32, at any alignment.
    unsafe { std::array::from_fn(|i| _mm512_loadu_ps(start.cast::<f32>().add(i * LANES))) }
}

/// For coordinate `axis`: which of the 32 values of the first two registers goes to each lane, and then which
/// of those and the third register.
const fn deinterleave_index(axis: usize) -> [[i32; LANES]; 2] {
    let mut index = [[0; LANES]; 2];
    let mut lane = 0;
    while lane < LANES {
        let from = 3 * lane + axis;
        if from < 32 {
            index[0][lane] = from as i32;
            index[1][lane] = lane as i32;
        } else {
            index[1][lane] = (from - 32 + LANES) as i32;
        }
        lane += 1;
    }
    index
}

const DEINTERLEAVE: [[[i32; LANES]; 2]; 3] = [
    deinterleave_index(0),
    deinterleave_index(1),
    deinterleave_index(2),
];

/// x y z x y z ... in three registers to x, y and z in one each.
#[inline]
#[target_feature(enable = "avx512f")]
fn deinterleave(a: __m512, b: __m512, c: __m512) -> [__m512; 3] {
    DEINTERLEAVE.map(|[first, second]| {
        let ab = _mm512_permutex2var_ps(a, lanes(&first), b);
        _mm512_permutex2var_ps(ab, lanes(&second), c)
    })
}

#[inline]
#[target_feature(enable = "avx512f")]
fn lanes(values: &[i32; LANES]) -> __m512i {
    // SAFETY: sixteen i32 are one register.
    unsafe { _mm512_loadu_si512(values.as_ptr().cast()) }
}

/// The twin of [`LatticeFromPoints::index`].
struct Quantise {
    rotation: [[__m512; 3]; 3],
    translation: [__m512; 3],
    per_resolution: __m512,
}

impl Quantise {
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load(t: &LatticeFromPoints) -> Self {
        Self {
            rotation: t.rotation.map(|row| row.map(|r| _mm512_set1_ps(r))),
            translation: t.translation.map(|c| _mm512_set1_ps(c)),
            per_resolution: _mm512_set1_ps(t.per_resolution),
        }
    }

    /// Indices of level 0, and a bit for each point that has them.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn index(&self, [x, y, z]: [__m512; 3]) -> ([__m512i; 3], u16) {
        let min = _mm512_set1_ps(LatticeFromPoints::QUANTISED_MIN);
        let end = _mm512_set1_ps(LatticeFromPoints::QUANTISED_END);
        let mut valid = u16::MAX;
        let mut index = [_mm512_setzero_si512(); 3];
        for (axis, index) in index.iter_mut().enumerate() {
            let [r0, r1, r2] = self.rotation[axis];
            let sum = _mm512_add_ps(_mm512_mul_ps(r0, x), _mm512_mul_ps(r1, y));
            let sum = _mm512_add_ps(sum, _mm512_mul_ps(r2, z));
            let scaled = _mm512_mul_ps(_mm512_add_ps(sum, self.translation[axis]), self.per_resolution);
            let q = _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(scaled);
            valid &= _mm512_cmp_ps_mask::<_CMP_GE_OQ>(q, min) & _mm512_cmp_ps_mask::<_CMP_LT_OQ>(q, end);
            *index = _mm512_cvttps_epi32(q);
        }
        (index, valid)
    }
}

/// The twin of `sharding::shard_of_region`.
#[inline]
#[target_feature(enable = "avx512f")]
fn shard([x, y, z]: [__m512i; 3]) -> __m512i {
    let colour = _mm512_slli_epi32::<2>(_mm512_add_epi32(y, z));
    let colour = _mm512_add_epi32(colour, _mm512_add_epi32(x, z));
    _mm512_and_si512(colour, _mm512_set1_epi32(SHARDS as i32 - 1))
}

/// Sixteen packed keys (`VoxelKey::pack`), eight a register.
#[inline]
#[target_feature(enable = "avx512f")]
fn pack(index: [__m512i; 3]) -> [__m512i; 2] {
    let field = _mm512_set1_epi32(0x1f_ffff);
    let [x, y, z] = index.map(|i| _mm512_and_si512(i, field));
    let low = _mm512_or_si512(x, _mm512_slli_epi32::<21>(y));
    let high = _mm512_or_si512(_mm512_srli_epi32::<11>(y), _mm512_slli_epi32::<10>(z));
    const FIRST: [i32; LANES] = [0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23];
    const SECOND: [i32; LANES] = [8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31];
    [FIRST, SECOND].map(|index| _mm512_permutex2var_epi32(low, lanes(&index), high))
}

/// Sixteen u32 as u64, eight a register.
#[inline]
#[target_feature(enable = "avx512f")]
fn widen(values: __m512i) -> [__m512i; 2] {
    [
        _mm512_cvtepu32_epi64(_mm512_castsi512_si256(values)),
        _mm512_cvtepu32_epi64(_mm512_extracti64x4_epi64::<1>(values)),
    ]
}

/// high32(mix(key)) and mix(key), for the mix of both the filter and the table.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
fn mix(key: __m512i, a: u64, b: u64) -> __m512i {
    let h = _mm512_mullo_epi64(key, _mm512_set1_epi64(a as i64));
    let h = _mm512_xor_si512(h, _mm512_srli_epi64::<32>(h));
    _mm512_mullo_epi64(h, _mm512_set1_epi64(b as i64))
}

/// high32(h) * n >> 32.
#[inline]
#[target_feature(enable = "avx512f")]
fn scale(h: __m512i, n: __m512i) -> __m512i {
    _mm512_srli_epi64::<32>(_mm512_mul_epu32(_mm512_srli_epi64::<32>(h), n))
}

/// One u64 a shard, in two registers.
#[derive(Clone, Copy)]
struct PerShard([__m512i; 2]);

impl PerShard {
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load(values: [u64; SHARDS]) -> Self {
        // SAFETY: eight u64 are one register.
        unsafe { Self([0, 8].map(|i| _mm512_loadu_si512(values[i..].as_ptr().cast()))) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn of(self, shard: __m512i) -> __m512i {
        _mm512_permutex2var_epi64(self.0[0], shard, self.0[1])
    }
}

fn addresses<T>(slices: [&[T]; SHARDS]) -> [u64; SHARDS] {
    slices.map(|slice| slice.as_ptr().expose_provenance() as u64)
}

fn lengths<T>(slices: [&[T]; SHARDS]) -> [u64; SHARDS] {
    slices.map(|slice| slice.len() as u64)
}

/// The counting Bloom filter with `HASHES` hashes; 0 = as many as the view says.
struct Bloom<const HASHES: u32>;

struct BloomRegisters {
    plane: PerShard,
    words: PerShard,
    hashes: u32,
}

impl<const HASHES: u32> Probe for Bloom<HASHES> {
    type Registers = BloomRegisters;

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn load(view: &LevelView<'_>) -> BloomRegisters {
        BloomRegisters {
            plane: PerShard::load(addresses(view.planes)),
            words: PerShard::load(lengths(view.planes)),
            hashes: view.hashes,
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn look_up(r: &BloomRegisters, index: [__m512i; 3], shard: __m512i) -> u16 {
        let (keys, shards) = (pack(index), widen(shard));
        let hashes = if HASHES == 0 { r.hashes } else { HASHES };
        let half = |i: usize| {
            let h = mix(keys[i], HASH_A, HASH_B);
            let word = scale(h, r.words.of(shards[i]));
            let address = _mm512_add_epi64(r.plane.of(shards[i]), _mm512_slli_epi64::<3>(word));
            // SAFETY: word < words of the shard's plane, which the view keeps alive.
            let plane = unsafe { _mm512_i64gather_epi64::<1>(address, std::ptr::null()) };
            let one = _mm512_set1_epi64(1);
            let mut g = _mm512_mul_epu32(h, _mm512_set1_epi64(HASH_C as i64));
            let mut mask = _mm512_sllv_epi64(one, _mm512_srli_epi64::<58>(g));
            for _ in 1..hashes {
                g = _mm512_slli_epi64::<6>(g);
                mask = _mm512_or_si512(mask, _mm512_sllv_epi64(one, _mm512_srli_epi64::<58>(g)));
            }
            u16::from(_mm512_cmpeq_epi64_mask(_mm512_and_si512(plane, mask), mask))
        };
        half(0) | half(1) << 8
    }
}

/// The table of blocks.
struct Exact;

struct ExactRegisters {
    keys: PerShard,
    masks: PerShard,
    slots: PerShard,
    up: u32,
}

impl Probe for Exact {
    type Registers = ExactRegisters;

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn load(view: &LevelView<'_>) -> ExactRegisters {
        ExactRegisters {
            keys: PerShard::load(addresses(view.blocks.map(|(keys, _)| keys))),
            masks: PerShard::load(addresses(view.blocks.map(|(_, masks)| masks))),
            slots: PerShard::load(lengths(view.blocks.map(|(keys, _)| keys))),
            up: view.up,
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn look_up(r: &ExactRegisters, index: [__m512i; 3], shard: __m512i) -> u16 {
        let up = _mm_cvtsi32_si128(r.up as i32);
        let to_block = _mm_cvtsi32_si128((BLOCK_LEVELS - r.up) as i32);
        let blocks = pack(index.map(|i| _mm512_sra_epi32(i, to_block)));
        let (cells, shards) = (widen(cell(index.map(|i| _mm512_sll_epi32(i, up)))), widen(shard));
        let half = |i: usize| {
            let slots = r.slots.of(shards[i]);
            let keys = r.keys.of(shards[i]);
            // SAFETY: `keys` and `slots` describe the tables of the view, each with a vacant slot.
            let (slot, found) = unsafe { find(blocks[i], keys, slots) };
            let word = _mm512_srli_epi64::<6>(cells[i]);
            let offset = _mm512_add_epi64(_mm512_slli_epi64::<6>(slot), _mm512_slli_epi64::<3>(word));
            let address = _mm512_add_epi64(r.masks.of(shards[i]), offset);
            // SAFETY: a found slot has a mask of eight words, of which this is one.
            let voxels = unsafe {
                _mm512_mask_i64gather_epi64::<1>(_mm512_setzero_si512(), found, address, std::ptr::null())
            };
            u16::from(_mm512_test_epi64_mask(voxels, within(cells[i], r.up)))
        };
        half(0) | half(1) << 8
    }
}

const _: () = assert!(size_of::<BlockMask>() == 64, "a slot's mask starts at slot << 6");

/// The twin of [`Cell::of`], for sixteen indices.
#[inline]
#[target_feature(enable = "avx512f")]
fn cell(index: [__m512i; 3]) -> __m512i {
    // The permutation looks at four bits of an index; the fourth selects the same values again.
    const SPREAD: [i32; LANES] = {
        let mut spread = [0; LANES];
        let mut i = 0;
        while i < LANES {
            spread[i] = (Cell::SPREAD >> ((i & 7) * 8)) as i32 & 0xff;
            i += 1;
        }
        spread
    };
    let [x, y, z] = index.map(|i| _mm512_permutexvar_epi32(i, lanes(&SPREAD)));
    _mm512_or_si512(
        x,
        _mm512_or_si512(_mm512_slli_epi32::<1>(y), _mm512_slli_epi32::<2>(z)),
    )
}

/// The twin of `BlockMask::within`.
#[inline]
#[target_feature(enable = "avx512f")]
fn within(cell: __m512i, up: u32) -> __m512i {
    match up {
        0 => _mm512_sllv_epi64(
            _mm512_set1_epi64(1),
            _mm512_and_si512(cell, _mm512_set1_epi64(63)),
        ),
        1 => _mm512_sllv_epi64(
            _mm512_set1_epi64(0xff),
            _mm512_and_si512(cell, _mm512_set1_epi64(0b11_1000)),
        ),
        _ => _mm512_set1_epi64(-1),
    }
}

/// The slots of eight blocks in tables of `slots` slots at addresses `keys`, and which of them were found: the
/// twin of `BlockTable::find`.
///
/// # Safety
/// Needs the features; each table must have its `slots` keys and at least one vacant slot.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn find(block: __m512i, keys: __m512i, slots: __m512i) -> (__m512i, __mmask8) {
    let vacant = _mm512_set1_epi64(VACANT as i64);
    let mut slot = scale(mix(block, BlockTable::HASH_A, BlockTable::HASH_B), slots);
    let mut found = 0;
    let mut searching = 0xff;
    loop {
        let address = _mm512_add_epi64(keys, _mm512_slli_epi64::<3>(slot));
        // SAFETY: slot < slots in every lane that is still searching.
        let key = unsafe { _mm512_mask_i64gather_epi64::<1>(vacant, searching, address, std::ptr::null()) };
        found |= _mm512_mask_cmpeq_epi64_mask(searching, key, block);
        searching &= _mm512_cmpneq_epi64_mask(key, block) & _mm512_cmpneq_epi64_mask(key, vacant);
        if searching == 0 {
            return (slot, found);
        }
        let next = _mm512_add_epi64(slot, _mm512_set1_epi64(1));
        let next = _mm512_maskz_mov_epi64(_mm512_cmpneq_epi64_mask(next, slots), next);
        slot = _mm512_mask_mov_epi64(slot, searching, next);
    }
}
