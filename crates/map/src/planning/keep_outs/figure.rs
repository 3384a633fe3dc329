//! Bodies in meters, as shapes are asked about them.

use super::shapes::Shapes;
use crate::map::KeepOut;
use crate::planning::body::{CellsFromLink, Link, Sphere};
use crate::planning::effort::Effort;

/// A body: its links, each in its own frame.
#[derive(Debug)]
pub(in crate::planning) struct Figure(pub(super) Vec<Solid>);

/// A link.
#[derive(Debug)]
pub(in crate::planning) struct Solid {
    /// Spheres in their order, points with padding after them: center and radius.
    spheres: Vec<([f64; 3], f64)>,
    /// Points without padding.
    points: Vec<[f64; 3]>,
    /// The ball around all of them.
    center_m: [f64; 3],
    radius_m: f64,
}

impl Figure {
    /// The body of these links.
    pub(in crate::planning) fn of(links: &[Link]) -> Self {
        Self(links.iter().map(Solid::of_link).collect())
    }

    /// Its links.
    pub(in crate::planning) fn links(&self) -> &[Solid] {
        &self.0
    }
}

impl Solid {
    fn of_link(link: &Link) -> Self {
        let (spheres, points) = link.balls_and_points();
        Self::of_parts(spheres, points)
    }

    /// Spheres alone.
    pub(in crate::planning) fn of_spheres(spheres: &[Sphere], padding_m: f32) -> Self {
        Self::of_parts(spheres.iter().map(|sphere| sphere.padded(padding_m)).collect(), Vec::new())
    }

    fn of_parts(spheres: Vec<([f64; 3], f64)>, points: Vec<[f64; 3]>) -> Self {
        let all = || spheres.iter().copied().chain(points.iter().map(|point| (*point, 0.0)));
        let count = all().count().max(1) as f64;
        let center_m =
            [0, 1, 2].map(|axis: usize| all().map(|(center, _)| center[axis]).sum::<f64>() / count);
        let reach = |(center, radius): ([f64; 3], f64)| {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| center[axis] - center_m[axis]);
            x.hypot(y).hypot(z) + radius
        };
        let radius_m = all().map(reach).fold(0.0, f64::max) * (1.0 + 1e-9);
        Self { spheres, points, center_m, radius_m }
    }

    /// The shapes that may be within `most_m` of it.
    fn near<'a>(
        &self,
        shapes: &Shapes<'a>,
        map_from_link: &CellsFromLink,
        most_m: f64,
        effort: &Effort<'_>,
    ) -> Shapes<'a> {
        shapes.near(map_from_link.cells(self.center_m), self.radius_m, most_m, effort)
    }

    /// The first part that meets a shape, and the shape: spheres before points.
    pub(super) fn first_met<'a>(
        &self,
        shapes: &Shapes<'a>,
        map_from_link: &CellsFromLink,
        effort: &Effort<'_>,
    ) -> Option<(usize, &'a KeepOut)> {
        let near = self.near(shapes, map_from_link, 0.0, effort);
        if near.is_empty() {
            return None;
        }
        let of_sphere = |(part, (center, radius)): (usize, &([f64; 3], f64))| {
            let met = near.nearest(map_from_link.cells(*center), *radius, effort);
            met.map(|(_, keep_out)| (part, keep_out))
        };
        let of_point = |(part, point): (usize, &[f64; 3])| {
            let keep_out = near.containing(map_from_link.cells(*point), effort);
            keep_out.map(|keep_out| (self.spheres.len() + part, keep_out))
        };
        let mut spheres = self.spheres.iter().enumerate().take_while(|_| effort.goes_on(1));
        let mut points = self.points.iter().enumerate().take_while(|_| effort.goes_on(1));
        spheres.find_map(of_sphere).or_else(|| points.find_map(of_point))
    }

    /// The distance to the nearest shape, meters, 0 where they meet; none where it is more than `most_m`.
    pub(super) fn distance_m(
        &self,
        shapes: &Shapes<'_>,
        map_from_link: &CellsFromLink,
        most_m: f64,
        effort: &Effort<'_>,
    ) -> Option<f64> {
        let near = self.near(shapes, map_from_link, most_m, effort);
        let mut least_m = None;
        if near.is_empty() {
            return None;
        }
        for (center, radius) in self.parts().take_while(|_| effort.goes_on(1)) {
            let within_m = radius + least_m.unwrap_or(most_m);
            if let Some((distance_m, _)) = near.nearest(map_from_link.cells(center), within_m, effort) {
                least_m = Some((distance_m - radius).max(0.0));
            }
        }
        least_m
    }

    /// True where a part of at most `radius_m` goes through a shape between two places that are so near to each other
    /// that its way is a line.
    pub(super) fn crosses(
        &self,
        shapes: &Shapes<'_>,
        [from, to]: [&CellsFromLink; 2],
        (radius_m, stride_m): (f64, f64),
        effort: &Effort<'_>,
    ) -> bool {
        let near = self.near(shapes, from, stride_m, effort);
        let mut thin =
            self.parts().filter(|(_, radius)| *radius <= radius_m).take_while(|_| effort.goes_on(1));
        !near.is_empty() && thin.any(|(center, _)| near.cross(from.cells(center), to.cells(center), effort))
    }

    /// Centers and radii of all parts.
    fn parts(&self) -> impl Iterator<Item = ([f64; 3], f64)> {
        self.spheres.iter().copied().chain(self.points.iter().map(|point| (*point, 0.0)))
    }
}
