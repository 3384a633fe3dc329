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
use crate::voxel::{BLOCK_LEVELS, BUCKET, BlockMask, Bucket, Cell, LatticeFromPoints, Slots};

/// Points a step: one f32 register an axis.
const LANES: usize = 16;
const _: () = assert!(SHARDS == LANES, "descriptors of all shards fill two registers of eight");

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
            (Lookup::Exact, _, false) => run::<Exact, false>(points, lattice_from_points, view, occupied),
            (Lookup::Exact, _, true) => run::<Exact, true>(points, lattice_from_points, view, occupied),
            (Lookup::Bloom, 2, false) => run::<Bloom<2>, false>(points, lattice_from_points, view, occupied),
            (Lookup::Bloom, 2, true) => run::<Bloom<2>, true>(points, lattice_from_points, view, occupied),
            (Lookup::Bloom, _, _) => run::<Bloom<0>, true>(points, lattice_from_points, view, occupied),
        }
    }
}

/// Structures up to this size are taken to lie in the core's own caches, where a prefetch only costs.
const NEAR_BYTES: usize = 1 << 20;

/// How the voxels of sixteen points are looked up, in steps with at most one cache miss a point each.
///
/// Where the structure is far larger than the caches, [`run`] takes the steps of different points in turn, 64
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

/// # Safety
/// Needs AVX-512 F and DQ, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn run<P: Probe, const FAR: bool>(
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
                located[group] = Some(P::locate::<FAR>(&r, index, shard));
            }
            (located, has_voxel)
        };
        let find = |(located, has_voxel): ([Option<P::Located>; GROUPS], u64)| {
            let mut found = [None; GROUPS];
            for (found, located) in found.iter_mut().zip(located) {
                if let Some(located) = located {
                    *found = Some(P::find::<FAR>(&r, located));
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
        if !FAR {
            for (word, points) in occupied.iter_mut().zip(words) {
                *word = answer(find(locate(points)));
            }
            return all_have_a_voxel;
        }
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

/// From points to indices of a level and shards.
struct Place {
    quantise: Quantise,
    level: __m128i,
    region_shift: __m128i,
}

impl Place {
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load(lattice_from_points: &LatticeFromPoints, view: &LevelView<'_>) -> Self {
        Self {
            quantise: Quantise::load(lattice_from_points),
            level: _mm_cvtsi32_si128(view.level as i32),
            region_shift: _mm_cvtsi32_si128(view.region_shift as i32),
        }
    }

    /// Indices, shards, and a bit for each of up to sixteen points that has them.
    ///
    /// # Safety
    /// Needs AVX-512 F.
    #[inline]
    #[target_feature(enable = "avx512f")]
    unsafe fn of(&self, points: &[Point]) -> ([__m512i; 3], __m512i, u16) {
        // SAFETY: the feature is there.
        let [a, b, c] = unsafe { load(points) };
        let (index, valid) = self.quantise.index(deinterleave(a, b, c));
        let index = index.map(|i| _mm512_sra_epi32(i, self.level));
        (index, shard(index.map(|i| _mm512_sra_epi32(i, self.region_shift))), valid)
    }
}

/// Starts fetching the lines at eight addresses.
///
/// # Safety
/// Needs AVX-512 F. Any address will do: a prefetch never faults.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn prefetch(addresses: __m512i) {
    let mut each = [0u64; 8];
    // SAFETY: a register is eight u64.
    unsafe {
        _mm512_storeu_si512(each.as_mut_ptr().cast(), addresses);
        for address in each {
            _mm_prefetch::<_MM_HINT_T0>(std::ptr::with_exposed_provenance(address as usize));
        }
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

const DEINTERLEAVE: [[[i32; LANES]; 2]; 3] =
    [deinterleave_index(0), deinterleave_index(1), deinterleave_index(2)];

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
    type Registers<'a> = BloomRegisters;
    /// Addresses of words of the planes, and the bits that count there; eight voxels a register.
    type Located = ([__m512i; 2], [__m512i; 2]);
    type Found = Self::Located;

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
    unsafe fn locate<const FAR: bool>(
        r: &BloomRegisters,
        index: [__m512i; 3],
        shard: __m512i,
    ) -> Self::Located {
        let (keys, shards) = (pack(index), widen(shard));
        let hashes = if HASHES == 0 { r.hashes } else { HASHES };
        let (a, b) = (r.word_of(keys[0], shards[0], hashes), r.word_of(keys[1], shards[1], hashes));
        if FAR {
            // SAFETY: a prefetch never faults.
            unsafe {
                prefetch(a.0);
                prefetch(b.0);
            }
        }
        ([a.0, b.0], [a.1, b.1])
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn find<const FAR: bool>(_: &BloomRegisters, located: Self::Located) -> Self::Found {
        located
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn answer(_: &BloomRegisters, (addresses, masks): Self::Found) -> u16 {
        // SAFETY: each address is of a word of a shard's plane, which the view keeps alive.
        let words = unsafe { gather(addresses) };
        let hit =
            |half: usize| _mm512_cmpeq_epi64_mask(_mm512_and_si512(words[half], masks[half]), masks[half]);
        u16::from(hit(0)) | u16::from(hit(1)) << 8
    }
}

impl BloomRegisters {
    /// The twin of `bloom::Probe::of` for eight keys: addresses of words, and masks.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn word_of(&self, key: __m512i, shard: __m512i, hashes: u32) -> (__m512i, __m512i) {
        let h = mix(key, HASH_A, HASH_B);
        let word = scale(h, self.words.of(shard));
        let address = _mm512_add_epi64(self.plane.of(shard), _mm512_slli_epi64::<3>(word));
        let one = _mm512_set1_epi64(1);
        let mut g = _mm512_mul_epu32(h, _mm512_set1_epi64(HASH_C as i64));
        let mut mask = _mm512_sllv_epi64(one, _mm512_srli_epi64::<58>(g));
        for _ in 1..hashes {
            g = _mm512_slli_epi64::<6>(g);
            mask = _mm512_or_si512(mask, _mm512_sllv_epi64(one, _mm512_srli_epi64::<58>(g)));
        }
        (address, mask)
    }
}

/// The u64 at each of sixteen addresses.
///
/// # Safety
/// Needs AVX-512 F; each address must be of a u64 that may be read.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn gather([a, b]: [__m512i; 2]) -> [__m512i; 2] {
    // SAFETY: as for this function.
    unsafe {
        let base = std::ptr::null();
        [_mm512_i64gather_epi64::<1>(a, base), _mm512_i64gather_epi64::<1>(b, base)]
    }
}

/// The table of blocks.
struct Exact;

struct ExactRegisters<'a> {
    view: &'a LevelView<'a>,
    keys: PerShard,
    masks: PerShard,
    buckets: PerShard,
}

/// Sixteen voxels on their way through the table; one at a time from here on, since each is compared with all
/// eight keys of its bucket at once.
#[derive(Clone, Copy)]
struct LocatedBlocks {
    blocks: [u64; LANES],
    shards: [u64; LANES],
    /// Addresses of the home buckets.
    buckets: [u64; LANES],
    /// Addresses of the voxels' words in the masks of the first slots of those buckets.
    words: [u64; LANES],
    /// The bits that count in those words.
    within: [__m512i; 2],
}

/// What a voxel of an absent block reads.
static NO_VOXELS: u64 = 0;

impl Probe for Exact {
    type Registers<'a> = ExactRegisters<'a>;
    type Located = LocatedBlocks;
    /// Addresses of words of masks, and the bits that count there.
    type Found = ([u64; LANES], [__m512i; 2]);

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn load<'a>(view: &'a LevelView<'_>) -> ExactRegisters<'a> {
        ExactRegisters {
            view,
            keys: PerShard::load(addresses(view.blocks.map(|slots| slots.keys))),
            masks: PerShard::load(addresses(view.blocks.map(|slots| slots.masks))),
            buckets: PerShard::load(lengths(view.blocks.map(|slots| slots.keys))),
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn locate<const FAR: bool>(
        r: &ExactRegisters<'_>,
        index: [__m512i; 3],
        shard: __m512i,
    ) -> LocatedBlocks {
        let up = r.view.up;
        let (left, right) = (_mm_cvtsi32_si128(up as i32), _mm_cvtsi32_si128((BLOCK_LEVELS - up) as i32));
        let blocks = pack(index.map(|i| _mm512_sra_epi32(i, right)));
        let cells = widen(cell(index.map(|i| _mm512_sll_epi32(i, left))));
        let shards = widen(shard);
        let bucket = |half: usize| {
            let h = mix(blocks[half], Slots::HASH_A, Slots::HASH_B);
            let bucket = scale(h, r.buckets.of(shards[half]));
            let keys = _mm512_add_epi64(r.keys.of(shards[half]), _mm512_slli_epi64::<6>(bucket));
            // A bucket's masks are 8 x 64 bytes.
            let masks = _mm512_add_epi64(r.masks.of(shards[half]), _mm512_slli_epi64::<9>(bucket));
            let word = _mm512_slli_epi64::<3>(_mm512_srli_epi64::<6>(cells[half]));
            (keys, _mm512_add_epi64(masks, word))
        };
        let (a, b) = (bucket(0), bucket(1));
        if FAR {
            // SAFETY: a prefetch never faults.
            unsafe {
                prefetch(a.0);
                prefetch(b.0);
            }
        }
        LocatedBlocks {
            blocks: to_array(blocks),
            shards: to_array(shards),
            buckets: to_array([a.0, b.0]),
            words: to_array([a.1, b.1]),
            within: [within(cells[0], up), within(cells[1], up)],
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn find<const FAR: bool>(r: &ExactRegisters<'_>, located: LocatedBlocks) -> Self::Found {
        let mut words = located.words;
        for (lane, word) in words.iter_mut().enumerate() {
            let block = located.blocks[lane];
            // SAFETY: the address is of a bucket of a shard's table, which the view keeps alive.
            let keys = unsafe {
                _mm512_loadu_si512(std::ptr::with_exposed_provenance(located.buckets[lane] as usize))
            };
            let equal = _mm512_cmpeq_epi64_mask(keys, _mm512_set1_epi64(block as i64));
            let in_slot =
                located.words[lane] + u64::from(equal.trailing_zeros()) * size_of::<BlockMask>() as u64;
            let absent = (&raw const NO_VOXELS).expose_provenance() as u64;
            *word = if equal != 0 { in_slot } else { absent };
            let full = _mm512_movepi64_mask(keys) & 0x80 == 0;
            if equal == 0 && full {
                *word = r.find_beyond(block, located.shards[lane], located.words[lane]).unwrap_or(absent);
            }
            if FAR {
                _mm_prefetch::<_MM_HINT_T0>(std::ptr::with_exposed_provenance(*word as usize));
            }
        }
        (words, located.within)
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    unsafe fn answer(_: &ExactRegisters<'_>, (words, within): Self::Found) -> u16 {
        // SAFETY: sixteen u64 are two registers; each is the address of a word of a mask that the view keeps alive,
        // or of `NO_VOXELS`.
        let voxels = unsafe {
            let [a, b] = [0, 8].map(|i| _mm512_loadu_si512(words[i..].as_ptr().cast()));
            gather([a, b])
        };
        let hit = |half: usize| _mm512_test_epi64_mask(voxels[half], within[half]);
        u16::from(hit(0)) | u16::from(hit(1)) << 8
    }
}

impl ExactRegisters<'_> {
    /// The address of a voxel's word where its block is not in its home bucket, which is full. `home_word` is what
    /// it would be in the home bucket's first slot.
    #[cold]
    fn find_beyond(&self, block: u64, shard: u64, home_word: u64) -> Option<u64> {
        let slots = self.view.blocks[shard as usize];
        let first_slot = Slots::home(block, slots.keys.len()) * BUCKET;
        let slot = slots.find(block)?;
        let moved = (slot as u64).wrapping_sub(first_slot as u64).wrapping_mul(size_of::<BlockMask>() as u64);
        Some(home_word.wrapping_add(moved))
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn to_array(registers: [__m512i; 2]) -> [u64; LANES] {
    let mut array = [0; LANES];
    for (half, register) in array.chunks_exact_mut(8).zip(registers) {
        // SAFETY: eight u64 are one register.
        unsafe { _mm512_storeu_si512(half.as_mut_ptr().cast(), register) };
    }
    array
}

const _: () =
    assert!(size_of::<Bucket>() == 64 && size_of::<BlockMask>() == 64, "as the shifts above take them");

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
    _mm512_or_si512(x, _mm512_or_si512(_mm512_slli_epi32::<1>(y), _mm512_slli_epi32::<2>(z)))
}

/// The twin of `BlockMask::within`.
#[inline]
#[target_feature(enable = "avx512f")]
fn within(cell: __m512i, up: u32) -> __m512i {
    match up {
        0 => _mm512_sllv_epi64(_mm512_set1_epi64(1), _mm512_and_si512(cell, _mm512_set1_epi64(63))),
        1 => _mm512_sllv_epi64(_mm512_set1_epi64(0xff), _mm512_and_si512(cell, _mm512_set1_epi64(0b11_1000))),
        _ => _mm512_set1_epi64(-1),
    }
}
