//! Volumetric sampling (paper III-A): one random point of each voxel of a sample lattice.

use hashbrown::HashMap;

use super::{RESOLUTION_MAX_M, RESOLUTION_MIN_M};
use crate::geometry::Point;

/// A scan thinned to about the wished number of points, evenly in space rather than in angle.
#[derive(Debug, Clone)]
pub struct VolumetricSample {
    /// The sampled points, in the order of the scan.
    pub points: Vec<Point>,
    /// The resolution of the sample lattice that gave them, metres.
    pub resolution_m: f64,
}

/// How near the number of sampled points has to come to the wish, as a fraction of it.
const TOLERANCE: f64 = 0.05;
/// Trials of the sample resolution, at most.
const TRIALS: usize = 16;
/// The first of them, metres.
const FIRST_M: f64 = 0.25;

/// Takes one random point of each voxel of a sample lattice, whose resolution is found by trial so that
/// about `wish` points result (paper III-A: "the volumetric sample resolution is adjusted to produce
/// approximately 1000 scan points").
///
/// III-B step 1 says "at the coarsest resolution" instead. A lattice tied to the map's coarsest level would
/// give anything from ten to ten thousand points; the number is what bounds the cost, so III-A is followed.
/// The choice within a voxel depends on `seed` and the point's place in the scan alone. `points` are finite;
/// a scan of at most `wish` points is returned whole.
pub fn volumetric_sample(points: &[Point], wish: usize, seed: u64) -> VolumetricSample {
    if points.len() <= wish {
        return VolumetricSample { points: points.to_vec(), resolution_m: 0.0 };
    }
    let (mut fine_m, mut coarse_m) = (RESOLUTION_MIN_M, RESOLUTION_MAX_M);
    let mut best = Vec::new();
    let (mut resolution_m, mut trial_m) = (coarse_m, FIRST_M);
    for _ in 0..TRIALS {
        let chosen = one_of_each_voxel(points, trial_m, seed);
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
    best.sort_unstable();
    VolumetricSample { points: best.into_iter().map(|i| points[i as usize]).collect(), resolution_m }
}

/// The place in the scan of one point of each voxel of a lattice of `resolution_m`.
fn one_of_each_voxel(points: &[Point], resolution_m: f64, seed: u64) -> Vec<u32> {
    let per_resolution = (1.0 / resolution_m) as f32;
    let mut chosen = HashMap::with_capacity(points.len() / 16);
    for (place, point) in points.iter().enumerate() {
        // Unlike a map's lattice this one need not be exact at its borders or reach far: it saturates.
        let voxel = point.xyz().map(|c| floor(c * per_resolution));
        let ticket = (lottery(seed, place as u64), place as u32);
        let winner = chosen.entry(voxel).or_insert(ticket);
        *winner = ticket.min(*winner);
    }
    let mut places: Vec<u32> = chosen.into_values().map(|(_, place)| place).collect();
    places.sort_unstable();
    places
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
}
