//! The box around points, which says what shards they need: a pass over all of them.

use crate::geometry::Point;
#[cfg(target_arch = "x86_64")]
use crate::util::cpu::Avx2;

/// Smallest and largest coordinates of some points.
pub(super) type Bounds = ([f32; 3], [f32; 3]);

/// Smallest and largest coordinates of the points; NaN is passed over. None without a point that has any.
pub(super) fn bounds(points: &[Point]) -> Option<Bounds> {
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx2::detect() {
        return bounds_avx2(cpu, points);
    }
    bounds_of::<LANES>(points)
}

/// Coordinates that are compared at once: those of eight points, so that both bounds stay in registers.
const LANES: usize = 24;

/// [`bounds`] with registers of twice the size.
#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
fn bounds_avx2(_: Avx2, points: &[Point]) -> Option<Bounds> {
    #[target_feature(enable = "avx2")]
    fn with_avx2(points: &[Point]) -> Option<Bounds> {
        bounds_of::<{ 2 * LANES }>(points)
    }
    // SAFETY: the token says that the CPU has the feature.
    unsafe { with_avx2(points) }
}

#[inline(always)]
fn bounds_of<const LANES: usize>(points: &[Point]) -> Option<Bounds> {
    let coordinates: &[[u8; 4]] = bytemuck::cast_slice(points);
    let (mut min, mut max) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let mut widen = |lanes: &[[u8; 4]]| {
        for ((min, max), bytes) in min.iter_mut().zip(&mut max).zip(lanes) {
            let c = f32::from_le_bytes(*bytes);
            // Not f32::min: this form compiles to one instruction and passes over NaN as well.
            *min = if c < *min { c } else { *min };
            *max = if c > *max { c } else { *max };
        }
    };
    let (whole, rest) = coordinates.as_chunks::<LANES>();
    whole.iter().for_each(|lanes| widen(lanes));
    widen(rest);
    let of_axis = |lanes: [f32; LANES], pick: fn(f32, f32) -> f32| -> [f32; 3] {
        std::array::from_fn(|axis| lanes[axis..].iter().step_by(3).copied().fold(lanes[axis], pick))
    };
    let (min, max) = (of_axis(min, f32::min), of_axis(max, f32::max));
    (0..3).all(|axis| min[axis] <= max[axis]).then_some((min, max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn wide_bounds_are_those_of_each_point(
            points in prop::collection::vec(prop::array::uniform3(prop_oneof![9 => -1e6f32..1e6, 1 => Just(f32::NAN)]), 0..70),
        ) {
            let points: Vec<Point> = points.into_iter().map(Point::from).collect();
            let mut expected = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
            for point in &points {
                for axis in 0..3 {
                    expected.0[axis] = expected.0[axis].min(point.xyz()[axis]);
                    expected.1[axis] = expected.1[axis].max(point.xyz()[axis]);
                }
            }
            let expected = (0..3).all(|axis| expected.0[axis] <= expected.1[axis]).then_some(expected);
            prop_assert_eq!(bounds(&points), expected);
            prop_assert_eq!(bounds_of::<LANES>(&points), expected);
        }
    }
}
