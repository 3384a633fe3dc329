//! The look-up of points, a batch at a time.

use super::bloom::Planes;
use super::exact::Tables;
use super::kernel::{BATCH, Batch, LookupKernel};
use super::locate::Locator;
use crate::geometry::Point;
use crate::map::lookup::level_view::{LevelView, Lookup};
use crate::util::cpu::Avx2;
use crate::voxel::LatticeFromPoints;
use crate::voxel::quantize::avx2::LANES;

/// See `lookup::occupied`.
pub(in crate::map::lookup) fn occupied(
    _: Avx2,
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    // SAFETY: the token says that the CPU has the feature; `occupied` holds a bit a point (asserted by our caller).
    unsafe {
        match lookup {
            Lookup::Bloom => {
                run(points, &Locator::load(lattice_from_points, view), &Planes::of(view), occupied)
            }
            Lookup::Exact => {
                run(points, &Locator::load(lattice_from_points, view), &Tables::of(view), occupied)
            }
        }
    }
}

/// # Safety
/// Needs AVX2, and a word of `occupied` for each 64 points.
#[target_feature(enable = "avx2")]
unsafe fn run(points: &[Point], locator: &Locator, probe: &impl LookupKernel, occupied: &mut [u64]) -> bool {
    let mut batch = Batch::EMPTY;
    let mut all_have_a_voxel = true;
    for (points, words) in points.chunks(BATCH).zip(occupied.chunks_mut(BATCH / 64)) {
        let mut has_voxel = [0u64; BATCH / 64];
        for (group, points) in points.chunks(LANES).enumerate() {
            let valid = locator.locate(points, group * LANES, &mut batch);
            let present = ((1u32 << points.len()) - 1) as u8;
            all_have_a_voxel &= valid & present == present;
            has_voxel[group / LANES] |= u64::from(valid & present) << (group % LANES * LANES);
        }
        // SAFETY: as for this function.
        let hits = unsafe { probe.look_up(&batch, points.len()) };
        for (i, word) in words.iter_mut().enumerate() {
            *word = hits[i] & has_voxel[i];
        }
    }
    all_have_a_voxel
}
