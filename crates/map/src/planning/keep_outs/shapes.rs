//! The keep-outs of a view as shapes: which is nearest, which contains a point, which a line crosses.

use crate::map::{KeepOut, MapView, ShapeRay};
use crate::planning::effort::Effort;

/// What rounding may move a bound of a distance by, as a share of the numbers that enter it.
const ROUNDING: f64 = 1e-9;

/// The keep-outs of a view, each with the box around it.
#[derive(Debug)]
pub(in crate::planning) struct Shapes<'a>(Vec<Bounded<'a>>);

/// A keep-out, and the smallest and largest coordinates of it.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct Bounded<'a> {
    pub(in crate::planning) keep_out: &'a KeepOut,
    min_m: [f64; 3],
    max_m: [f64; 3],
}

impl<'a> Shapes<'a> {
    /// The keep-outs that a view has; none where there are none, or it was not asked for them.
    pub(in crate::planning) fn of(view: &'a MapView<'_>) -> Option<Self> {
        let keep_outs = view.keep_outs().filter(|keep_outs| !keep_outs.is_empty())?;
        Some(Self(keep_outs.iter().map(Bounded::of).collect()))
    }

    /// All of them, by name.
    pub(in crate::planning) fn iter(&self) -> impl Iterator<Item = &Bounded<'a>> {
        self.0.iter()
    }

    /// Those that may be within `most` of a ball.
    pub(super) fn near(&self, center_m: [f64; 3], radius_m: f64, most_m: f64, effort: &Effort<'_>) -> Self {
        let within_m = radius_m + most_m;
        let tested = self.tested(effort).filter(|of| of.distance_min_m(center_m) <= within_m);
        Self(tested.copied().collect())
    }

    /// All of them, each counted as a test and its corners more; they end once stopped.
    fn tested(&self, effort: &Effort<'_>) -> impl Iterator<Item = &Bounded<'a>> {
        self.iter().take_while(|of| effort.goes_on(1 + of.keep_out.shape.corners() as u32))
    }

    /// True without a keep-out.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The nearest one that is at most `most_m` away, and how far; of several as near the first by name.
    pub(in crate::planning) fn nearest(
        &self,
        point_m: [f64; 3],
        most_m: f64,
        effort: &Effort<'_>,
    ) -> Option<(f64, &'a KeepOut)> {
        let mut nearest = None;
        let mut best_m = most_m;
        for of in self.tested(effort).filter(|of| of.distance_min_m(point_m) <= most_m) {
            let distance_m = of.keep_out.shape.distance_m(point_m);
            if distance_m < best_m || distance_m == best_m && nearest.is_none() {
                (best_m, nearest) = (distance_m, Some(of.keep_out));
            }
        }
        nearest.map(|keep_out| (best_m, keep_out))
    }

    /// The first one by name that contains the point.
    pub(super) fn containing(&self, point_m: [f64; 3], effort: &Effort<'_>) -> Option<&'a KeepOut> {
        let mut near = self.tested(effort).filter(|of| of.distance_min_m(point_m) <= 0.0);
        near.find(|of| of.keep_out.shape.contains(point_m)).map(|of| of.keep_out)
    }

    /// True where the line between two places shares a point with one of them.
    pub(super) fn cross(&self, from_m: [f64; 3], to_m: [f64; 3], effort: &Effort<'_>) -> bool {
        let way = [0, 1, 2].map(|axis: usize| to_m[axis] - from_m[axis]);
        let length_m = way[0].hypot(way[1]).hypot(way[2]);
        let ray = ShapeRay { origin_m: from_m, direction: way.map(|c| c / length_m) };
        let mut tested = self.tested(effort).filter(|of| of.distance_min_m(from_m) <= length_m);
        length_m > 0.0 && tested.any(|of| of.keep_out.shape.entered_m(&ray).is_some_and(|at| at <= length_m))
    }
}

impl<'a> Bounded<'a> {
    fn of(keep_out: &'a KeepOut) -> Self {
        let (min_m, max_m) = keep_out.shape.bounds_m();
        Self { keep_out, min_m, max_m }
    }

    /// A lower bound of the distance, meters.
    fn distance_min_m(&self, point_m: [f64; 3]) -> f64 {
        let gap = |axis: usize| {
            let (low, high) = (self.min_m[axis] - point_m[axis], point_m[axis] - self.max_m[axis]);
            low.max(high).max(0.0)
                - ROUNDING * (self.max_m[axis].abs().max(self.min_m[axis].abs()) + point_m[axis].abs())
        };
        let [x, y, z] = [0, 1, 2].map(|axis| gap(axis).max(0.0));
        x.hypot(y).hypot(z) * (1.0 - ROUNDING)
    }
}
