//! Whether bodies at poses stay within the map's lattice: of what lies beyond nothing can be known.

use super::configurations::{Configurations, NUMBERS_PER_POSE};
use super::in_cells::{BodyInCells, LinkInCells};
use super::parts::Sphere;
use super::placement::{CellsFromLink, LinkPose};
use crate::planning::error::PlanningError;
use crate::planning::unknown::Surroundings;
use crate::voxel::Lattice;

/// How far a map reaches along each axis, for bodies in cells of a level.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct Reach {
    /// Smallest coordinate of the lattice, and one past the largest, meters.
    min_m: f64,
    end_m: f64,
    /// How far around a body the answer depends on what is there, meters.
    around_m: f64,
    cells_per_m: f64,
}

impl Reach {
    /// The reach of a lattice for bodies in so many cells a meter, of whose surroundings it counts up to `most_m` how
    /// near they are. Where unknown voxels count, all of that must be in the lattice: beyond all is unknown.
    pub(in crate::planning) fn of(
        lattice: &Lattice,
        cells_per_m: f64,
        surroundings: &Surroundings,
        most_m: f32,
    ) -> Self {
        let (min_m, end_m) = lattice.range_m();
        let around_m = if surroundings.unknown_counts() { f64::from(most_m) } else { 0.0 };
        Self { min_m, end_m, around_m, cells_per_m }
    }

    /// Refuses spheres that reach beyond the lattice with their padding.
    ///
    /// # Errors
    /// For the first such sphere.
    pub(in crate::planning) fn check_spheres(
        &self,
        spheres: &[Sphere],
        padding_m: f32,
    ) -> Result<(), PlanningError> {
        let is_beyond = |sphere: &Sphere| {
            let (center_m, radius_m) = sphere.padded(padding_m);
            !self.has_ball(center_m, radius_m)
        };
        let Self { min_m, end_m, around_m, .. } = *self;
        let refused = |sphere| PlanningError::SphereRange { sphere, around_m, min_m, end_m };
        spheres.iter().position(is_beyond).map_or(Ok(()), |sphere| Err(refused(sphere)))
    }

    /// True where a ball and what counts around it lie within the lattice.
    #[inline(always)]
    fn has_ball(&self, center_m: [f64; 3], radius_m: f64) -> bool {
        // NaN is nowhere.
        let radius_m = radius_m + self.around_m;
        center_m.iter().all(|c| c - radius_m >= self.min_m && c + radius_m < self.end_m)
    }

    /// Refuses configurations in which a link may reach beyond the lattice.
    ///
    /// # Errors
    /// For the first such link.
    pub(in crate::planning) fn check_poses(
        &self,
        body: &BodyInCells,
        configurations: &Configurations<'_>,
    ) -> Result<(), PlanningError> {
        for configuration in 0..configurations.len() {
            let mut links = body.links.iter().zip(configurations.poses_of(configuration));
            let beyond =
                links.position(|(link, pose)| !self.has_any_turn(link, pose) && !self.has_link(link, pose));
            if let Some(link) = beyond {
                return Err(self.refused(configuration, link));
            }
        }
        Ok(())
    }

    /// Refuses a motion from one configuration to the next on which a link may reach beyond the lattice.
    ///
    /// # Errors
    /// For the first such link, with the configuration of the two that is nearer to what is beyond.
    pub(in crate::planning) fn check_motion(
        &self,
        body: &BodyInCells,
        configurations: &Configurations<'_>,
        from: usize,
    ) -> Result<(), PlanningError> {
        let ends = [from, from + 1].map(|configuration| configurations.poses_of(configuration));
        for (number, link) in body.links.iter().enumerate() {
            let poses = ends.map(|poses| &poses[number]);
            // Between two places of the link's origin lie only places between: the lattice has no hollows.
            if poses.iter().all(|pose| self.has_any_turn(link, pose)) {
                continue;
            }
            // So it is of the ball around a link that does not turn.
            let turns = poses[0][3..] != poses[1][3..];
            let beyond = poses.iter().position(|pose| !self.has_link(link, pose));
            let beyond = beyond
                .or_else(|| turns.then(|| poses.iter().position(|pose| !self.has_any_turn(link, pose)))?);
            if let Some(end) = beyond {
                return Err(self.refused(from + end, number));
            }
        }
        Ok(())
    }

    /// True where a link lies within the lattice however it is turned.
    #[inline(always)]
    fn has_any_turn(&self, link: &LinkInCells, pose: &[f32; NUMBERS_PER_POSE]) -> bool {
        let [x, y, z, ..] = *pose;
        link.is_nowhere() || self.has_ball([x, y, z].map(f64::from), link.extent_m)
    }

    /// True where the ball around a link lies within the lattice.
    #[cold]
    fn has_link(&self, link: &LinkInCells, pose: &[f32; NUMBERS_PER_POSE]) -> bool {
        let cells_from_link = CellsFromLink::of(&LinkPose::of(pose), self.cells_per_m);
        let (center_m, radius) = (link.ball.center_m, link.ball.radius);
        let center = cells_from_link.cells(center_m);
        link.is_nowhere() || self.has_ball(center.map(|c| c / self.cells_per_m), radius / self.cells_per_m)
    }

    fn refused(&self, configuration: usize, link: usize) -> PlanningError {
        let Self { min_m, end_m, around_m, .. } = *self;
        PlanningError::BodyRange { configuration, link, around_m, min_m, end_m }
    }
}
