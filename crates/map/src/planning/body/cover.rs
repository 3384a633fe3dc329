//! Spheres that cover boxes and capsules, for bodies that are not drawn in spheres.

use super::parts::{RADIUS_MAX_M, Sphere};

/// Spheres of one cover, at most.
pub const COVER_SPHERES_MAX: usize = 16_384;

/// Why a shape cannot be covered.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CoverError {
    /// A side, length or radius that is none.
    #[error("{field} must lie in 0..={RADIUS_MAX_M} m, got {value}")]
    Size {
        /// Which number it is.
        field: &'static str,
        /// The number, meters.
        value: f32,
    },
    /// A margin that is none.
    #[error("margin_m must be above 0 and finite, got {0}")]
    Margin(f32),
    /// More spheres than a cover may have.
    #[error(
        "a margin of {margin_m} m takes {spheres} spheres, at most {COVER_SPHERES_MAX} are made: take a larger one"
    )]
    Spheres {
        /// How far the spheres may reach beyond the shape, meters.
        margin_m: f32,
        /// Number of spheres.
        spheres: f64,
    },
}

/// Spheres that cover a box of sides `size_m` about the origin and reach beyond it by `margin_m` at most.
///
/// # Errors
/// When a number is out of range, or the cover would have more than [`COVER_SPHERES_MAX`] spheres.
pub fn cover_box(size_m: [f32; 3], margin_m: f32) -> Result<Vec<Sphere>, CoverError> {
    check_margin(margin_m)?;
    size_m.iter().try_for_each(|side| check_size("size_m", *side))?;
    // A cell of half sides h is within a sphere of radius |h|, which reaches |h| - h_i beyond it along axis i: not more
    // than the diagonal of its two other half sides.
    let half_max_m = f64::from(margin_m) / std::f64::consts::SQRT_2;
    let cells = size_m.map(|side| (f64::from(side) / (2.0 * half_max_m)).ceil().max(1.0));
    check_count(cells.iter().product(), margin_m)?;
    let half_m: [f64; 3] = std::array::from_fn(|axis| f64::from(size_m[axis]) / cells[axis] / 2.0);
    let radius_m = rounded_up(half_m.iter().map(|half| half * half).sum::<f64>().sqrt());
    let center = |axis: usize, cell: u32| {
        (half_m[axis] * (2.0 * f64::from(cell) + 1.0) - f64::from(size_m[axis]) / 2.0) as f32
    };
    let [columns, rows, layers] = cells.map(|count| count as u32);
    let cell = |number: u32| [number % columns, number / columns % rows, number / columns / rows];
    let sphere =
        |cell: [u32; 3]| Sphere { center_m: std::array::from_fn(|axis| center(axis, cell[axis])), radius_m };
    Ok((0..columns * rows * layers).map(|number| sphere(cell(number))).collect())
}

/// Spheres that cover a capsule, all points within `radius_m` of the line from `from_m` to `to_m`, and are larger than
/// it by `margin_m` at most.
///
/// # Errors
/// When a number is out of range, or the cover would have more than [`COVER_SPHERES_MAX`] spheres.
pub fn cover_capsule(
    from_m: [f32; 3],
    to_m: [f32; 3],
    radius_m: f32,
    margin_m: f32,
) -> Result<Vec<Sphere>, CoverError> {
    check_margin(margin_m)?;
    check_size("radius_m", radius_m)?;
    let [from, to] = [from_m, to_m].map(|end| end.map(f64::from));
    let length_m = (0..3).map(|axis| (to[axis] - from[axis]).powi(2)).sum::<f64>().sqrt();
    check_size("the length", length_m as f32)?;
    let (radius, largest) = (f64::from(radius_m), f64::from(radius_m) + f64::from(margin_m));
    // Halfway between two centers the spheres are as wide as the capsule.
    let gap_max_m = 2.0 * (largest * largest - radius * radius).sqrt();
    let gaps = (length_m / gap_max_m).ceil();
    check_count(gaps + 1.0, margin_m)?;
    let half_gap_m = length_m / gaps.max(1.0) / 2.0;
    let radius_m = rounded_up((radius * radius + half_gap_m * half_gap_m).sqrt());
    let center = |number: u32| {
        let share = f64::from(number) / gaps.max(1.0);
        std::array::from_fn(|axis| (from[axis] + share * (to[axis] - from[axis])) as f32)
    };
    Ok((0..=gaps as u32).map(|number| Sphere { center_m: center(number), radius_m }).collect())
}

/// A float that is not less, with room for what rounding a center takes off.
fn rounded_up(radius_m: f64) -> f32 {
    (radius_m * (1.0 + 1e-6)) as f32
}

fn check_size(field: &'static str, value: f32) -> Result<(), CoverError> {
    if (0.0..=RADIUS_MAX_M).contains(&value) { Ok(()) } else { Err(CoverError::Size { field, value }) }
}

fn check_margin(margin_m: f32) -> Result<(), CoverError> {
    if margin_m > 0.0 && margin_m.is_finite() { Ok(()) } else { Err(CoverError::Margin(margin_m)) }
}

fn check_count(spheres: f64, margin_m: f32) -> Result<(), CoverError> {
    if spheres <= COVER_SPHERES_MAX as f64 { Ok(()) } else { Err(CoverError::Spheres { margin_m, spheres }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// How far a point lies outside of all spheres, meters; negative inside of one.
    fn outside(spheres: &[Sphere], point: [f64; 3]) -> f64 {
        let from = |sphere: &Sphere| {
            let along = |axis: usize| point[axis] - f64::from(sphere.center_m[axis]);
            (0..3).map(|axis| along(axis).powi(2)).sum::<f64>().sqrt() - f64::from(sphere.radius_m)
        };
        spheres.iter().map(from).fold(f64::INFINITY, f64::min)
    }

    fn unit(direction: [f64; 3]) -> [f64; 3] {
        let length = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
        direction.map(|c| c / length)
    }

    proptest! {
        #[test]
        fn a_box_is_covered_and_its_spheres_stay_within_the_margin(
            size in prop::array::uniform3(0.0f32..2.0),
            margin in 0.1f32..0.5,
            share in prop::array::uniform3(-0.5f64..=0.5),
            direction in prop::array::uniform3(0.1f64..1.0),
            signs in prop::array::uniform3(prop::sample::select(vec![-1.0, 1.0])),
        ) {
            let spheres = cover_box(size, margin).unwrap();
            let inside = std::array::from_fn(|axis| share[axis] * f64::from(size[axis]));
            prop_assert!(outside(&spheres, inside) <= 1e-6);
            let way = unit(std::array::from_fn(|axis| direction[axis] * signs[axis]));
            for Sphere { center_m, radius_m } in spheres {
                let beyond = |axis: usize| {
                    let at = f64::from(center_m[axis]) + way[axis] * f64::from(radius_m);
                    (at.abs() - f64::from(size[axis]) / 2.0).max(0.0)
                };
                let beyond = (0..3).map(|axis| beyond(axis).powi(2)).sum::<f64>().sqrt();
                prop_assert!(beyond <= f64::from(margin) * 1.001, "{beyond} of {margin}");
            }
        }

        #[test]
        fn a_capsule_is_covered_and_its_spheres_are_no_larger_than_the_margin_allows(
            from in prop::array::uniform3(-1.0f32..1.0),
            to in prop::array::uniform3(-1.0f32..1.0),
            radius in 0.0f32..0.5,
            margin in 0.01f32..0.3,
            along in 0.0f64..=1.0,
            direction in prop::array::uniform3(0.1f64..1.0),
            signs in prop::array::uniform3(prop::sample::select(vec![-1.0, 1.0])),
        ) {
            let spheres = cover_capsule(from, to, radius, margin).unwrap();
            let way = unit(std::array::from_fn(|axis| direction[axis] * signs[axis]));
            let inside = std::array::from_fn(|axis| {
                let [a, b] = [from, to].map(|end| f64::from(end[axis]));
                a + along * (b - a) + way[axis] * f64::from(radius)
            });
            prop_assert!(outside(&spheres, inside) <= 1e-6);
            let largest = (f64::from(radius) + f64::from(margin)) * 1.001;
            prop_assert!(spheres.iter().all(|sphere| f64::from(sphere.radius_m) <= largest));
        }
    }

    #[test]
    fn numbers_that_cover_nothing_are_refused() {
        assert_eq!(cover_box([0.0; 3], 0.1).unwrap().len(), 1);
        assert_eq!(cover_capsule([0.0; 3], [0.0; 3], 0.2, 0.1).unwrap().len(), 1);
        for margin in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(matches!(cover_box([1.0; 3], margin), Err(CoverError::Margin(_))), "{margin}");
        }
        assert!(matches!(cover_box([-1.0, 1.0, 1.0], 0.1), Err(CoverError::Size { .. })));
        assert!(matches!(cover_capsule([f32::NAN; 3], [0.0; 3], 0.1, 0.1), Err(CoverError::Size { .. })));
        assert!(matches!(cover_box([100.0; 3], 0.01), Err(CoverError::Spheres { .. })));
        assert!(matches!(
            cover_capsule([0.0; 3], [900.0, 0.0, 0.0], 0.1, 1e-9),
            Err(CoverError::Spheres { .. })
        ));
    }
}
