//! Volumetric sampling (paper III-A): one random point of each voxel of a sample lattice.

use hashbrown::HashMap;

use super::lattice::{RESOLUTION_MAX_M, RESOLUTION_MIN_M};
use crate::geometry::Point;
use crate::util::StopSignal;

/// A scan thinned to about the wished number of points, evenly in space rather than in angle.
#[derive(Debug, Clone)]
pub struct VolumetricSample {
    /// The sampled points, in the order of the scan.
    pub points: Vec<Point>,
    /// The resolution of the sample lattice that gave them, meters.
    pub resolution_m: f64,
}

/// How near the number of sampled points has to come to the wish, as a fraction of it.
const TOLERANCE: f64 = 0.05;
/// Trials of the sample resolution, at most.
const TRIALS: usize = 16;
/// The first of them, meters.
const FIRST_M: f64 = 0.25;
/// Points that are looked at between two looks at the stop signal: a millisecond or less.
const POINTS_PER_STOP_CHECK: usize = 16 << 10;
/// Times the wish that no sample exceeds. Points that are each alone in the coarsest voxel, as no scan's are, would
/// otherwise all be taken.
const WISHES_MAX: usize = 4;

/// Takes one random point of each voxel of a sample lattice, whose resolution is found by trial so that
/// about `wish` points result (paper III-A: "the volumetric sample resolution is adjusted to produce
/// approximately 1000 scan points").
///
/// III-B step 1 says "at the coarsest resolution" instead. A lattice tied to the map's coarsest level would
/// give anything from ten to ten thousand points; the number is what bounds the cost, so III-A is followed.
/// The choice within a voxel depends on `seed` and the point's place in the scan alone. `points` are finite;
/// a scan of at most `wish` points is returned whole.
pub fn volumetric_sample(points: &[Point], wish: usize, seed: u64) -> VolumetricSample {
    volumetric_sample_until(points, wish, seed, StopSignal::NEVER)
}

/// [`volumetric_sample`], which once it is stopped takes the best of the trials so far; without one, points at even
/// distances in the order of the scan.
pub fn volumetric_sample_until(
    points: &[Point],
    wish: usize,
    seed: u64,
    stop: StopSignal<'_>,
) -> VolumetricSample {
    if points.len() <= wish {
        return VolumetricSample { points: points.to_vec(), resolution_m: 0.0 };
    }
    let (mut fine_m, mut coarse_m) = (RESOLUTION_MIN_M, RESOLUTION_MAX_M);
    let mut best = Vec::new();
    let (mut resolution_m, mut trial_m) = (coarse_m, FIRST_M);
    for _ in 0..TRIALS {
        let Some(chosen) = one_of_each_voxel(points, trial_m, seed, stop) else { break };
        let count = chosen.len();
        if best.is_empty() || count.abs_diff(wish) < best.len().abs_diff(wish) {
            (best, resolution_m) = (chosen, trial_m);
        }
        if count.abs_diff(wish) as f64 <= TOLERANCE * wish as f64 {
            break;
        }
        if count > wish {
            fine_m = trial_m
        } else {
            coarse_m = trial_m
        }
        // Voxels of a surface grow in number with the inverse square of their side.
        let of_a_surface_m = trial_m * (count as f64 / wish as f64).sqrt();
        let halfway_m = (fine_m * coarse_m).sqrt();
        trial_m = if (fine_m..coarse_m).contains(&of_a_surface_m) { of_a_surface_m } else { halfway_m };
    }
    if best.is_empty() {
        best = (0..points.len() as u32).step_by(points.len().div_ceil(wish.max(1))).collect();
    }
    if best.len() > wish.saturating_mul(WISHES_MAX).max(1) {
        best.select_nth_unstable_by_key(wish, |&place| lottery(seed, u64::from(place)));
        best.truncate(wish);
    }
    best.sort_unstable();
    VolumetricSample { points: best.into_iter().map(|i| points[i as usize]).collect(), resolution_m }
}

/// Bytes that a sample of `points` points takes while it is made, at most: a table of as many voxels as points, and the
/// one of half the size that it grew out of.
pub fn sample_bytes_max(points: usize) -> usize {
    const OF_VOXEL: usize = size_of::<([i32; 3], (u64, u32))>() + 1;
    let places = points.saturating_mul(8).div_ceil(7).next_power_of_two();
    places / 2 * 3 * OF_VOXEL + 3 * points * size_of::<u32>()
}

/// The place in the scan of one point of each voxel of a lattice of `resolution_m`, in no order; none once stopped.
fn one_of_each_voxel(
    points: &[Point],
    resolution_m: f64,
    seed: u64,
    stop: StopSignal<'_>,
) -> Option<Vec<u32>> {
    let per_resolution = (1.0 / resolution_m) as f32;
    let mut chosen = HashMap::with_capacity(points.len() / 16);
    for (place, point) in points.iter().enumerate() {
        if place.is_multiple_of(POINTS_PER_STOP_CHECK) && stop.is_stopped() {
            return None;
        }
        // Unlike a map's lattice this one need not be exact at its borders or reach far: it saturates.
        let voxel = point.xyz().map(|c| floor(c * per_resolution));
        let ticket = (lottery(seed, place as u64), place as u32);
        let winner = chosen.entry(voxel).or_insert(ticket);
        *winner = ticket.min(*winner);
    }
    Some(chosen.into_values().map(|(_, place)| place).collect())
}

/// Rounds down. Plain x86-64 has no instruction for it and would call a library.
fn floor(c: f32) -> i32 {
    let towards_zero = c as i32;
    towards_zero - i32::from(towards_zero as f32 > c)
}

/// A number drawn for a point: SplitMix64 of the seed and its place, so that the smallest in a voxel is a
/// uniform choice and no generator has to be drawn in order.
fn lottery(seed: u64, place: u64) -> u64 {
    let mut z = seed.wrapping_add(place.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall with a hundred times more points near the sensor than far from it.
    fn wall() -> Vec<Point> {
        (0..40_000)
            .map(|i| Point::new((i as f32 / 40_000.0).powi(4) * 10.0, (i % 97) as f32 * 0.03, 2.0))
            .collect()
    }

    #[test]
    fn a_sample_has_about_the_wished_number_of_points() {
        for wish in [200, 1000, 3000] {
            let sample = volumetric_sample(&wall(), wish, 1);
            let error = sample.points.len().abs_diff(wish) as f64 / wish as f64;
            assert!(error < 0.15, "{} points for {wish}", sample.points.len());
        }
    }

    #[test]
    fn a_sample_is_even_in_space_where_the_scan_is_not() {
        let near = |points: &[Point]| {
            points.iter().filter(|p| p.xyz()[0] < 5.0).count() as f64 / points.len() as f64
        };
        assert!(near(&wall()) > 0.8);
        let sampled = near(&volumetric_sample(&wall(), 1000, 1).points);
        assert!((0.4..0.65).contains(&sampled), "{sampled} of the sample lies in the near half");
    }

    #[test]
    fn the_seed_decides_the_sample() {
        let sample = |seed| volumetric_sample(&wall(), 500, seed).points;
        assert_eq!(sample(1), sample(1));
        assert_ne!(sample(1), sample(2));
    }

    #[test]
    fn a_sample_that_is_stopped_has_about_the_wished_number_of_points() {
        let looks = std::cell::Cell::new(0);
        let after = |most: u32| {
            looks.set(0);
            let is_over = || looks.replace(looks.get() + 1) >= most;
            volumetric_sample_until(&wall(), 500, 1, StopSignal::when(&is_over)).points.len()
        };
        assert_eq!(after(0), 500);
        // In the midst of the first trial.
        assert_eq!((after(2), looks.get()), (500, 3));
    }

    #[test]
    fn it_looks_at_the_signal_as_often_as_the_scan_is_large() {
        for scans in [1, 4, 16] {
            let looks = std::cell::Cell::new(0);
            let count = || looks.replace(looks.get() + 1) == usize::MAX;
            let points = wall().repeat(scans);
            volumetric_sample_until(&points, 500, 1, StopSignal::when(&count));
            assert!(looks.get() >= points.len() / POINTS_PER_STOP_CHECK, "{} looks", looks.get());
        }
    }

    #[test]
    fn points_alone_in_the_coarsest_voxels_are_thinned_all_the_same() {
        let apart: Vec<Point> = (0..20_000).map(|i| Point::new(i as f32 * 1000.0, 0.0, 1e30)).collect();
        assert_eq!(volumetric_sample(&apart, 500, 1).points.len(), 500);
    }
}
