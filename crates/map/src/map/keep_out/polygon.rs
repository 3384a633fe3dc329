//! Geometry of simple polygons in the plane, given by their corners in order.

/// A point of the plane.
type Point2 = [f64; 2];

/// Two corners at one place; none where all differ.
pub(super) fn repeated_corners(corners: &[Point2]) -> Option<(usize, usize)> {
    pairs(corners.len()).find(|&(i, j)| corners[i] == corners[j])
}

/// True when all corners lie on one line.
pub(super) fn is_flat(corners: &[Point2]) -> bool {
    sides(corners).next().is_none_or(|(a, b)| corners.iter().all(|&corner| turn(a, b, corner) == 0.0))
}

/// Two sides that share a point which they should not, by their first corners; none of a simple polygon. No corner may
/// come twice.
pub(super) fn crossing_sides(corners: &[Point2]) -> Option<(usize, usize)> {
    let all: Vec<_> = sides(corners).collect();
    let last = all.len() - 1;
    pairs(all.len()).find(|&(i, j)| match (i, j) {
        // Neighbors share a corner; nothing else where the path does not turn back on itself.
        _ if j == i + 1 => turns_back(all[i].0, all[i].1, all[j].1),
        (0, j) if j == last => turns_back(all[j].0, all[j].1, all[0].1),
        (i, j) => touch(all[i], all[j]),
    })
}

/// True when the point lies inside the polygon or on a side.
pub(super) fn contains(corners: &[Point2], point: Point2) -> bool {
    let mut is_inside = false;
    for (a, b) in sides(corners) {
        let side = turn(a, b, point);
        if side == 0.0 && is_between(a, b, point) {
            return true;
        }
        // A ray to the right crosses a side that goes up past the point's left hand, and one that goes down on its
        // right.
        let goes_up = a[1] <= point[1];
        if goes_up != (b[1] <= point[1]) && goes_up == (side > 0.0) {
            is_inside = !is_inside;
        }
    }
    is_inside
}

/// How far the point lies from the polygon; 0 inside.
pub(super) fn distance(corners: &[Point2], point: Point2) -> f64 {
    if contains(corners, point) {
        return 0.0;
    }
    sides(corners).map(|(a, b)| distance_of_side(a, b, point)).fold(f64::INFINITY, f64::min)
}

fn distance_of_side(a: Point2, b: Point2, point: Point2) -> f64 {
    let away = away_from_side(a, b, point);
    away[0].hypot(away[1])
}

/// The way from the nearest place of a side to the point.
fn away_from_side(a: Point2, b: Point2, point: Point2) -> Point2 {
    let (along, from_a) = (minus(b, a), minus(point, a));
    let share = (dot(from_a, along) / dot(along, along)).clamp(0.0, 1.0);
    minus(from_a, along.map(|c| c * share))
}

/// The place of the polygon that is nearest to the point.
pub(super) fn nearest_place(corners: &[Point2], point: Point2) -> Point2 {
    if contains(corners, point) {
        return point;
    }
    let away = sides(corners).map(|(a, b)| away_from_side(a, b, point));
    let nearest = away.min_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
    nearest.map_or(point, |away| minus(point, away))
}

/// How far along a line, in lengths of `direction` from `origin`, it crosses or touches sides that do not lie along it.
pub(super) fn crossings(corners: &[Point2], origin: Point2, direction: Point2) -> impl Iterator<Item = f64> {
    // Which hand a corner is on is decided for the corner, so that no line slips through between two sides.
    let hand = move |corner: Point2| {
        let way = minus(corner, origin);
        direction[0] * way[1] - direction[1] * way[0]
    };
    sides(corners).filter_map(move |(a, b)| {
        let (of_a, of_b) = (hand(a), hand(b));
        let place = match (of_a >= 0.0) != (of_b >= 0.0) {
            true => [0, 1].map(|axis: usize| a[axis] + (b[axis] - a[axis]) * (of_a / (of_a - of_b))),
            false if of_a == 0.0 => a,
            false => return None,
        };
        let at = dot(minus(place, origin), direction) / dot(direction, direction);
        at.is_finite().then_some(at)
    })
}

/// True where a side shares a point with the closed rectangle.
pub(super) fn meets_rectangle(corners: &[Point2], min: Point2, max: Point2) -> bool {
    sides(corners).any(|(a, b)| {
        let mut span = (0.0f64, 1.0f64);
        for axis in 0..2 {
            let way = b[axis] - a[axis];
            if way == 0.0 {
                if !(min[axis]..=max[axis]).contains(&a[axis]) {
                    return false;
                }
                continue;
            }
            let (one, other) = ((min[axis] - a[axis]) / way, (max[axis] - a[axis]) / way);
            span = (span.0.max(one.min(other)), span.1.min(one.max(other)));
        }
        span.0 <= span.1
    })
}

/// The corners of the smallest convex polygon around points (Andrew's monotone chain).
pub(super) fn hull(mut points: Vec<Point2>) -> Vec<Point2> {
    points.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let chain = |points: &mut dyn Iterator<Item = &Point2>| {
        let mut chain: Vec<Point2> = Vec::new();
        for &point in points {
            while let [.., a, b] = chain[..]
                && turn(a, b, point) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        // It is the first of the other chain.
        chain.pop();
        chain
    };
    let mut corners = chain(&mut points.iter());
    corners.extend(chain(&mut points.iter().rev()));
    corners
}

/// The sides, from each corner to the next and from the last to the first.
fn sides(corners: &[Point2]) -> impl Iterator<Item = (Point2, Point2)> {
    let next = corners.iter().cycle().skip(1);
    corners.iter().copied().zip(next.copied())
}

/// All pairs i < j of so many.
fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |i| (i + 1..count).map(move |j| (i, j)))
}

/// Positive where the path a, b, c turns to the left, negative to the right, 0 on a line: twice the triangle's area.
fn turn(a: Point2, b: Point2, c: Point2) -> f64 {
    let (ab, ac) = (minus(b, a), minus(c, a));
    ab[0] * ac[1] - ab[1] * ac[0]
}

/// True when the path a, b, c goes back over itself.
fn turns_back(a: Point2, b: Point2, c: Point2) -> bool {
    turn(a, b, c) == 0.0 && dot(minus(b, a), minus(c, b)) < 0.0
}

/// True when two sides share a point.
fn touch((a, b): (Point2, Point2), (c, d): (Point2, Point2)) -> bool {
    let (of_c, of_d, of_a, of_b) = (turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b));
    let is_apart = |one: f64, other: f64| one > 0.0 && other < 0.0 || one < 0.0 && other > 0.0;
    is_apart(of_c, of_d) && is_apart(of_a, of_b)
        || of_c == 0.0 && is_between(a, b, c)
        || of_d == 0.0 && is_between(a, b, d)
        || of_a == 0.0 && is_between(c, d, a)
        || of_b == 0.0 && is_between(c, d, b)
}

/// True when a point of the line through a and b lies between them, or on one of them.
fn is_between(a: Point2, b: Point2, point: Point2) -> bool {
    (0..2).all(|axis| (a[axis].min(b[axis])..=a[axis].max(b[axis])).contains(&point[axis]))
}

fn minus(a: Point2, b: Point2) -> Point2 {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Point2, b: Point2) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Of whole numbers, whose areas and turns are exact.
    fn corners() -> impl Strategy<Value = Vec<Point2>> {
        prop::collection::vec(prop::array::uniform2(-6i8..=6).prop_map(|corner| corner.map(f64::from)), 3..9)
    }

    fn is_simple(corners: &[Point2]) -> bool {
        repeated_corners(corners).is_none() && !is_flat(corners) && crossing_sides(corners).is_none()
    }

    /// A polygon without crossings: corners at many angles about the origin.
    fn star() -> impl Strategy<Value = Vec<Point2>> {
        prop::collection::vec(1.0..5.0f64, 3..40).prop_map(|radii| {
            let corner = |(i, radius): (usize, &f64)| {
                let (sin, cos) = (i as f64 * std::f64::consts::TAU / radii.len() as f64).sin_cos();
                [cos * radius, sin * radius]
            };
            radii.iter().enumerate().map(corner).collect()
        })
    }

    /// How often the path goes round the point, by the angles of its sides.
    fn windings(corners: &[Point2], point: Point2) -> f64 {
        let angle = |(a, b): (Point2, Point2)| {
            let (a, b) = (minus(a, point), minus(b, point));
            (a[0] * b[1] - a[1] * b[0]).atan2(dot(a, b))
        };
        sides(corners).map(angle).sum::<f64>() / std::f64::consts::TAU
    }

    /// True when the point is on a side, whose angles then tell nothing; exact for whole numbers.
    fn is_on_a_side(corners: &[Point2], point: Point2) -> bool {
        sides(corners).any(|(a, b)| {
            let (a, b) = (minus(a, point), minus(b, point));
            a[0] * b[1] == a[1] * b[0] && dot(a, b) <= 0.0
        })
    }

    /// The smallest distance of many points on the sides.
    fn sampled_distance(corners: &[Point2], point: Point2) -> f64 {
        let on_side = |(a, b): (Point2, Point2)| {
            (0..=2000).map(move |i| {
                std::array::from_fn(|axis| a[axis] + (b[axis] - a[axis]) * f64::from(i) / 2000.0)
            })
        };
        let away = |on: Point2| minus(on, point);
        sides(corners)
            .flat_map(on_side)
            .map(|on| away(on)[0].hypot(away(on)[1]))
            .fold(f64::INFINITY, f64::min)
    }

    /// True when two of the sides share a point, of so many that are looked at; whole numbers tell it exactly in
    /// halves.
    fn crosses_itself(corners: &[Point2]) -> bool {
        let all: Vec<_> = sides(corners).collect();
        pairs(all.len()).any(|(i, j)| {
            let ((a, b), (c, d)) = (all[i], all[j]);
            let (ab, cd, ac) = (minus(b, a), minus(d, c), minus(c, a));
            let cross = |p: Point2, q: Point2| p[0] * q[1] - p[1] * q[0];
            let (denominator, is_next) = (cross(ab, cd), j == i + 1 || i == 0 && j == all.len() - 1);
            if denominator != 0.0 {
                // The lines meet in one point: of neighbors, the corner that they share.
                let (s, t) = (cross(ac, cd), cross(ac, ab));
                let within = |share: f64| (0.0..=denominator.abs()).contains(&(share * denominator.signum()));
                return !is_next && within(s) && within(t);
            }
            if cross(ab, ac) != 0.0 {
                return false;
            }
            // On one line: their spans along it overlap by more than the corner that neighbors share.
            let place = |p: Point2| dot(minus(p, a), ab);
            let (low, high) = (place(c).min(place(d)).max(0.0), place(c).max(place(d)).min(dot(ab, ab)));
            if is_next { low < high } else { low <= high }
        })
    }

    proptest! {
        #[test]
        fn a_polygon_is_simple_where_no_two_of_its_sides_meet(corners in corners()) {
            prop_assume!(repeated_corners(&corners).is_none() && !is_flat(&corners));
            prop_assert_eq!(crossing_sides(&corners).is_some(), crosses_itself(&corners));
        }

        #[test]
        fn a_point_is_inside_where_the_path_goes_round_it(
            polygon in prop_oneof![corners().prop_filter("simple", |corners| is_simple(corners)), star()],
            point in prop_oneof![prop::array::uniform2(-6.0..6.0f64), prop::array::uniform2(-6i8..=6).prop_map(|p| p.map(f64::from))],
        ) {
            let border = if is_on_a_side(&polygon, point) { 0.0 } else { sampled_distance(&polygon, point) };
            let turns = windings(&polygon, point).abs();
            if border > 1e-9 {
                prop_assert_eq!(contains(&polygon, point), turns > 0.5, "{} turns", turns);
            }
            let expected = if border > 1e-9 && turns > 0.5 { 0.0 } else { border };
            // Samples are at most 12 * sqrt(2) / 2000 apart.
            let found = distance(&polygon, point);
            prop_assert!(found <= expected + 1e-9 && found >= expected - 5e-3, "{} is not {}", found, expected);
        }

        #[test]
        fn corners_and_points_of_sides_belong_to_a_polygon(polygon in corners().prop_filter("simple", |corners| is_simple(corners))) {
            for (a, b) in sides(&polygon) {
                let middle = std::array::from_fn(|axis| (a[axis] + b[axis]) / 2.0);
                prop_assert!(contains(&polygon, a) && contains(&polygon, middle));
            }
        }
    }
}
