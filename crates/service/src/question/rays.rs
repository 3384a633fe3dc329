//! Rays: what each meets first.

use super::known::KnownPart;
use super::pieces::Pieces;
use super::planner_question::{Question, check_elements};
use super::question_target::QuestionTarget;
use super::scope::QuestionScope;
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::request::PointCloud;
use mrol_map::map::ContentVersion;
use mrol_map::planning::{RayError, RayHits, Rays, Toward, Unknown, cast_rays, cast_rays_in_sight};
use mrol_map::util::StopSignal;

/// What do these rays meet?
#[derive(Debug, Clone, PartialEq)]
pub struct RayQuestion {
    /// What it has in common with other questions.
    pub asked: QuestionScope,
    /// Where each ray begins, meters in the map frame: one point for each ray, or one for all of them.
    pub origins: PointCloud,
    /// Where each ray leads.
    pub toward: RaysToward,
    /// What unknown voxels count as.
    pub unknown: Unknown,
}

/// Where rays lead.
#[derive(Debug, Clone, PartialEq)]
pub enum RaysToward {
    /// Along unit vectors.
    Directions {
        /// A direction for each ray, of length 1 within [`DIRECTION_LENGTH_TOLERANCE`].
        ///
        /// [`DIRECTION_LENGTH_TOLERANCE`]: mrol_map::planning::DIRECTION_LENGTH_TOLERANCE
        directions: PointCloud,
        /// Length of each ray, meters, above 0; infinite for rays that end with the map.
        range_m: f64,
    },
    /// To the point where each ray ends.
    Ends(PointCloud),
}

/// Bytes of a ray in an answer: a distance, a voxel, the number of a keep-out, and a bit.
const BYTES_EACH: usize = 17;
/// How long a ray takes, nanoseconds.
const NS_EACH: usize = 300;
/// The same where unknown voxels are met: rays of a few hundred voxels.
const NS_EACH_IN_SIGHT: usize = 10_000;

impl RayQuestion {
    fn rays(&self) -> Rays<'_> {
        let toward = match &self.toward {
            RaysToward::Directions { directions, range_m } => {
                Toward::Directions { directions: directions.as_slice(), range_m: *range_m }
            }
            RaysToward::Ends(ends) => Toward::Ends(ends.as_slice()),
        };
        Rays { origins: self.origins.as_slice(), toward }
    }

    fn elements(&self) -> usize {
        self.rays().len()
    }
}

impl Question for RayQuestion {
    type Answer = RayHits;

    const OPERATION: &'static str = "CastRays";

    fn asked(&self) -> &QuestionScope {
        &self.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        self.elements() * BYTES_EACH
    }

    fn work_ns(&self) -> usize {
        // Where unknown voxels are met rays go voxel by voxel.
        match self.unknown {
            Unknown::Free => self.elements().saturating_mul(NS_EACH),
            Unknown::Occupied => usize::MAX,
        }
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        check_elements("rays", self.elements(), BYTES_EACH, limits)
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        _: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(RayHits, ContentVersion), ServiceError> {
        let (rays, level) = (self.rays(), self.asked.level);
        rays.checked()?;
        let ns_each = match self.unknown {
            Unknown::Free => NS_EACH,
            Unknown::Occupied => NS_EACH_IN_SIGHT,
        };
        let view = || map.whole_view(&self.asked, self.elements(), stop);
        Pieces::of(rays.len(), ns_each).answered(stop, view, |view, piece| {
            let (before, part) = (piece.start, rays.part(piece));
            let hits = match self.unknown {
                Unknown::Free => cast_rays(&view.view, &part, level, stop),
                Unknown::Occupied => cast_rays_in_sight(&view.view, &part, level, stop),
            };
            Ok(hits.map_err(|error| rays.error_behind(before, error))?)
        })
    }

    fn check_known(&self, answer: &RayHits, known: &KnownPart) -> Result<(), ServiceError> {
        let rays = self.rays();
        for (i, told_m) in answer.distances_m.iter().enumerate() {
            let (origin_m, end_m) = rays.ends_m(i, f64::from(*told_m))?;
            for (of, place_m) in [("begins", origin_m), ("goes on", end_m)] {
                let what = || format!("rays[{i}] {of} where it");
                known.check_ball(what, place_m.map(|c| known.within(c)), 0.0)?;
            }
        }
        Ok(())
    }
}

impl From<RayError> for ServiceError {
    fn from(error: RayError) -> Self {
        let reason = match error {
            RayError::EndRange { .. } | RayError::Leaves { .. } => Reason::PointOutOfRange,
            _ => Reason::BadRay,
        };
        Self::new(reason, error.to_string())
    }
}
