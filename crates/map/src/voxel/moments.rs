//! Moments of the points in a voxel, in integers: what the refinement of an alignment knows of a surface.

use std::ops::AddAssign;

/// The level whose voxels keep moments: 4 r_0 wide, large enough for a plane to show, small enough to follow a
/// room's furniture. Coarser ones are sums of these.
pub const MOMENT_LEVEL: u32 = 2;

/// How far points lie from the center of their voxel, summed: count, sum d and sum d d^T.
///
/// Offsets d are whole numbers of 1 / [`Moments::UNITS`] of the voxel's side, of points multiples of [`Moments::STEP`],
/// so that sums neither round nor depend on their order: every thread count gives the same map, and a map without a
/// scan is that of the others.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Moments([i64; Moments::NUMBERS]);

impl Moments {
    /// Units of an offset along a voxel's side; a unit is 0.04 mm of a voxel of 0.16 m.
    pub const UNITS: i64 = 4096;
    /// Units to which the offsets of points are rounded: 0.6 mm of a voxel of 0.16 m, so that a byte holds one.
    /// Finer ones would tell a sensor's noise, for two fifths more journal. Maps of former versions have them.
    pub const STEP: i64 = 16;
    /// Count, the three of sum d, the six of sum d d^T (xx xy xz yy yz zz).
    pub const NUMBERS: usize = 10;
    /// Points of one voxel, at most. More of them say nothing new, and no sum comes near the end of its numbers, about
    /// whatever center it is taken.
    pub const COUNT_MAX: i64 = 1 << 32;

    /// The moments of one point at an offset from the center.
    pub fn of_offset([x, y, z]: [i64; 3]) -> Self {
        Self([1, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z])
    }

    /// The moments of the centers of a voxel's descendants two levels down, which `word` holds in Morton order: what
    /// stays known when points were deleted.
    pub(crate) fn of_descendants(word: u64) -> Self {
        let axis = |bit: u32, axis: u32| i64::from(bit >> axis & 1 | bit >> (axis + 2) & 2);
        let mut moments = Self::default();
        for bit in (0..u64::BITS).filter(|bit| word >> bit & 1 == 1) {
            moments += Self::of_offset([0, 1, 2].map(|a| (2 * axis(bit, a) - 3) * (Self::UNITS / 8)));
        }
        moments
    }

    /// The numbers, in the order of [`Moments::NUMBERS`].
    pub fn to_numbers(self) -> [i64; Self::NUMBERS] {
        self.0
    }

    /// The inverse of [`Moments::to_numbers`]; none where no points within a voxel have them, or too many.
    pub fn from_numbers(numbers: [i64; Self::NUMBERS]) -> Option<Self> {
        const HALF: i64 = Moments::UNITS / 2;
        let [count, first @ .., xx, xy, xz, yy, yz, zz] = numbers;
        let possible = |sums: &[i64], least: i64, most: i64| sums.iter().all(|s| (least..=most).contains(s));
        let fits = (0..=Self::COUNT_MAX).contains(&count)
            && possible(&first, -count * HALF, count * HALF)
            && possible(&[xx, yy, zz], 0, count * HALF * HALF)
            && possible(&[xy, xz, yz], -count * HALF * HALF, count * HALF * HALF);
        fits.then_some(Self(numbers))
    }

    /// Number of points.
    pub fn count(&self) -> i64 {
        self.0[0]
    }

    /// True when no point is left.
    pub fn is_empty(&self) -> bool {
        self.count() == 0
    }

    /// The moments of the same points about a center that lies `by` units away: each offset grows by that.
    pub fn about(&self, [x, y, z]: [i64; 3]) -> Self {
        let [n, sx, sy, sz, xx, xy, xz, yy, yz, zz] = self.0;
        Self([
            n,
            sx + n * x,
            sy + n * y,
            sz + n * z,
            xx + 2 * sx * x + n * x * x,
            xy + sx * y + sy * x + n * x * y,
            xz + sx * z + sz * x + n * x * z,
            yy + 2 * sy * y + n * y * y,
            yz + sy * z + sz * y + n * y * z,
            zz + 2 * sz * z + n * z * z,
        ])
    }

    /// Mean offset and covariance (xx xy xz yy yz zz) of the points, in units and their squares; none without a point.
    pub fn gaussian(&self) -> Option<([f64; 3], [f64; 6])> {
        let n = self.count() as f64;
        if self.is_empty() {
            return None;
        }
        let mean: [f64; 3] = std::array::from_fn(|i| self.0[1 + i] as f64 / n);
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        let covariance = std::array::from_fn(|k| {
            let (i, j) = pairs[k];
            self.0[4 + k] as f64 / n - mean[i] * mean[j]
        });
        Some((mean, covariance))
    }
}

impl AddAssign for Moments {
    /// Points that would be more than [`Moments::COUNT_MAX`] with those that are there are left out.
    fn add_assign(&mut self, other: Self) {
        if self.count() + other.count() <= Self::COUNT_MAX {
            self.0.iter_mut().zip(other.0).for_each(|(mine, other)| *mine += other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(offsets: &[[i64; 3]]) -> Moments {
        let mut sum = Moments::default();
        offsets.iter().for_each(|&offset| sum += Moments::of_offset(offset));
        sum
    }

    fn offset() -> impl Strategy<Value = [i64; 3]> {
        let half = Moments::UNITS / 2;
        [-half..=half, -half..=half, -half..=half]
    }

    proptest! {
        #[test]
        fn moments_of_points_are_told_from_numbers_that_are_none(
            offsets in proptest::collection::vec(offset(), 0..50), numbers: [i64; Moments::NUMBERS],
        ) {
            let moments = of(&offsets);
            prop_assert_eq!(Moments::from_numbers(moments.to_numbers()), Some(moments));
            prop_assert_eq!(Moments::from_numbers(numbers), None);
        }

        #[test]
        fn moments_about_another_center_are_those_of_shifted_points(
            offsets in proptest::collection::vec(offset(), 1..50), by in offset(),
        ) {
            let shifted: Vec<_> = offsets.iter().map(|d| [0, 1, 2].map(|i| d[i] + by[i])).collect();
            prop_assert_eq!(of(&offsets).about(by), of(&shifted));
        }
    }

    #[test]
    fn a_gaussian_has_the_mean_and_the_covariance_of_the_points() {
        let (mean, covariance) = of(&[[2, 0, 0], [4, 0, 0], [2, 6, 0], [4, 6, 0]]).gaussian().unwrap();
        assert_eq!((mean, covariance), ([3.0, 3.0, 0.0], [1.0, 0.0, 0.0, 9.0, 0.0, 0.0]));
        assert_eq!(Moments::default().gaussian(), None);
    }

    #[test]
    fn a_voxel_that_is_full_takes_no_more_points() {
        let (half, most) = (Moments::UNITS / 2, Moments::COUNT_MAX);
        let corner = Moments::of_offset([half; 3]).to_numbers();
        let full = Moments::from_numbers(corner.map(|number| number * most)).unwrap();
        let mut sum = full;
        sum += Moments::of_offset([0; 3]);
        assert_eq!(sum, full);
        // About the farthest center that coarser levels need.
        let farther = Moments::of_offset([4 * half; 3]).to_numbers();
        assert_eq!(full.about([3 * half; 3]).to_numbers(), farther.map(|number| number * most));
        let beyond = Moments::of_offset([half + 1, 0, 0]).to_numbers();
        assert_eq!(Moments::from_numbers(beyond), None);
    }
}
