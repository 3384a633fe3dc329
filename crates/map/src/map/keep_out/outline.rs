//! What of a shape lies within a band of height, seen from above.

use super::polygon;
use super::shape::KeepOutShape;
use crate::map::regions::{OrientedBox, Region};

/// What is seen of a shape from above.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline {
    /// A disc.
    Disc {
        /// Its center, meters.
        center_m: [f64; 2],
        /// Its radius, meters.
        radius_m: f64,
    },
    /// A polygon by its corners, meters; of a shape without extent a line or a point.
    Polygon(Vec<[f64; 2]>),
}

impl KeepOutShape {
    /// What of the shape lies between two heights or on them, seen from above; none where nothing does.
    pub fn outline(&self, [low_m, high_m]: [f64; 2]) -> Option<Outline> {
        let is_within = |from: f64, to: f64| from <= high_m && to >= low_m;
        match self {
            Self::Region(Region::Box { min_m: [x, y, from], max_m: [to_x, to_y, to] }) => {
                is_within(*from, *to)
                    .then(|| Outline::Polygon(vec![[*x, *y], [*to_x, *y], [*to_x, *to_y], [*x, *to_y]]))
            }
            Self::Region(Region::Sphere { center_m: [x, y, z], radius_m }) => {
                let beyond = (low_m - z).max(z - high_m).max(0.0);
                let squared = radius_m * radius_m - beyond * beyond;
                (squared >= 0.0).then(|| Outline::Disc { center_m: [*x, *y], radius_m: squared.sqrt() })
            }
            Self::Region(Region::OrientedBox(of)) => outline_of_box(of, [low_m, high_m]),
            Self::Prism(prism) => {
                let [from, to] = prism.z_m();
                is_within(from, to).then(|| Outline::Polygon(prism.corners_m().to_vec()))
            }
        }
    }
}

/// The hull of the corners of a box that lie in a band, and of the places where its edges leave the band.
fn outline_of_box(of: &OrientedBox, band_m: [f64; 2]) -> Option<Outline> {
    let half_m = of.size_m().map(|side| side / 2.0);
    let corner = |number: usize| {
        let in_box: [f64; 3] =
            std::array::from_fn(|axis| if number >> axis & 1 == 1 { half_m[axis] } else { -half_m[axis] });
        of.map_from_box().transform_point(&in_box.into()).into()
    };
    let corners: [[f64; 3]; 8] = std::array::from_fn(corner);
    let inside = corners.iter().filter(|corner| (band_m[0]..=band_m[1]).contains(&corner[2]));
    let mut points: Vec<[f64; 2]> = inside.map(|[x, y, _]| [*x, *y]).collect();
    let edges = (0..8).flat_map(|from| (0..3).map(move |axis| (from, from | 1 << axis)));
    for (from, to) in edges.filter(|(from, to)| from != to) {
        points.extend(band_m.iter().filter_map(|height| at_height(corners[from], corners[to], *height)));
    }
    (!points.is_empty()).then(|| Outline::Polygon(polygon::hull(points)))
}

/// Where an edge passes a height.
fn at_height(a: [f64; 3], b: [f64; 3], height: f64) -> Option<[f64; 2]> {
    let share = (height - a[2]) / (b[2] - a[2]);
    (0.0..=1.0).contains(&share).then(|| [0, 1].map(|axis: usize| a[axis] + share * (b[axis] - a[axis])))
}

impl Outline {
    /// True where the outline, its border included, shares a point with the closed rectangle.
    pub fn meets(&self, min_m: [f64; 2], max_m: [f64; 2]) -> bool {
        match self {
            Self::Disc { center_m, radius_m } => {
                let gap =
                    |axis: usize| (min_m[axis] - center_m[axis]).max(center_m[axis] - max_m[axis]).max(0.0);
                gap(0).hypot(gap(1)) <= *radius_m
            }
            Self::Polygon(corners) => {
                let middle = [0, 1].map(|axis: usize| (min_m[axis] + max_m[axis]) / 2.0);
                polygon::meets_rectangle(corners, min_m, max_m) || polygon::contains(corners, middle)
            }
        }
    }

    /// Smallest and largest x and y, meters.
    pub fn bounds_m(&self) -> ([f64; 2], [f64; 2]) {
        match self {
            Self::Disc { center_m, radius_m } => {
                (center_m.map(|c| c - radius_m), center_m.map(|c| c + radius_m))
            }
            Self::Polygon(corners) => {
                let along = |axis: usize, from: f64, pick: fn(f64, f64) -> f64| {
                    corners.iter().map(|corner| corner[axis]).fold(from, pick)
                };
                let low = [0, 1].map(|axis| along(axis, f64::INFINITY, f64::min));
                (low, [0, 1].map(|axis| along(axis, f64::NEG_INFINITY, f64::max)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::map::keep_out::test_shapes::shape;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn an_outline_meets_a_rectangle_where_the_shape_has_a_point_above_it_in_the_band(
            shape in shape(), min in prop::array::uniform2(-25.0..25.0f64), side in 0.1..4.0f64, low in -25.0..25.0f64, height in 0.0..20.0f64,
        ) {
            let (max, band) = (min.map(|c| c + side), [low, low + height]);
            // 11 x 11 x 41 points of the column.
            let point = |n: usize| {
                let share = |n: usize, of: usize| n as f64 / of as f64;
                [min[0] + side * share(n % 11, 10), min[1] + side * share(n / 11 % 11, 10), low + height * share(n / 121, 40)]
            };
            let sampled = (0..11 * 11 * 41).any(|n| shape.contains(point(n)));
            let nearest = (0..11 * 11 * 41).map(|n| shape.distance_m(point(n))).fold(f64::INFINITY, f64::min);
            let meets = shape.outline(band).is_some_and(|outline| outline.meets(min, max));
            prop_assert!(meets || !sampled, "a point of the column lies in the shape");
            // No place of the column is further from one of the points than this.
            let apart = (side * 0.1 * 0.71).hypot(height / 80.0);
            prop_assert!(!meets || nearest <= apart, "it is {} away", nearest);
            if let Some(outline) = shape.outline(band) {
                let (low, high) = outline.bounds_m();
                prop_assert!(outline.meets(low, high));
            }
        }
    }
}
