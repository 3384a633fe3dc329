//! The nearest voxel of points.

use super::known::KnownPart;
use super::pieces::Pieces;
use super::planner_question::{Question, check_elements};
use super::question_target::QuestionTarget;
use super::scope::QuestionScope;
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::request::PointCloud;
use mrol_map::geometry::Point;
use mrol_map::map::ContentVersion;
use mrol_map::planning::{MeasuredTo, NearestError, NearestRequest, NearestVoxels, find_nearest};
use mrol_map::util::StopSignal;

/// How far is the nearest occupied voxel of these points?
#[derive(Debug, Clone, PartialEq)]
pub struct NearestQuestion {
    /// What it has in common with other questions.
    pub asked: QuestionScope,
    /// The points, meters in the map frame.
    pub points: PointCloud,
    /// How far to look, meters: above 0, at most [`RADIUS_VOXELS_MAX`](mrol_map::planning::RADIUS_VOXELS_MAX) voxels.
    pub radius_m: f64,
    /// What of a voxel distances are measured to.
    pub to: MeasuredTo,
}

/// Bytes of a point in an answer: a distance, a voxel, a direction, the number of a keep-out, and a bit.
const BYTES_EACH: usize = 29;
/// How long a point takes, nanoseconds.
const NS_EACH: usize = 700;

impl Question for NearestQuestion {
    type Answer = NearestVoxels;

    const OPERATION: &'static str = "FindNearest";

    fn asked(&self) -> &QuestionScope {
        &self.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        self.points.len() * BYTES_EACH
    }

    fn work_ns(&self) -> usize {
        self.points.len().saturating_mul(NS_EACH)
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        check_elements("points", self.points.len(), BYTES_EACH, limits)?;
        let points = self.points.as_slice();
        let Some(place) = points.iter().position(|point: &Point| !point.is_finite()) else { return Ok(()) };
        let message = format!("points[{place}] is not finite: {:?}", points[place]);
        Err(ServiceError::new(Reason::PointNotFinite, message))
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        _: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(NearestVoxels, ContentVersion), ServiceError> {
        let Self { asked, points, radius_m, to } = self;
        let view = || map.whole_view(asked, points.len(), stop);
        Pieces::of(points.len(), NS_EACH).answered(stop, view, |view, piece| {
            let (before, points) = (piece.start, &points.as_slice()[piece]);
            let request = NearestRequest { points, level: asked.level, radius_m: *radius_m, to: *to };
            let nearest = find_nearest(&view.view, &request, stop);
            Ok(nearest.map_err(|error| error.behind(before))?)
        })
    }

    fn check_known(&self, answer: &NearestVoxels, known: &KnownPart) -> Result<(), ServiceError> {
        let points = self.points.as_slice().iter().zip(&answer.distances_m).enumerate();
        points.into_iter().try_for_each(|(i, (point, told_m))| {
            let what = || format!("points[{i}]");
            known.check_ball(what, point.xyz().map(f64::from), f64::from(*told_m).min(self.radius_m))
        })
    }
}

impl From<NearestError> for ServiceError {
    fn from(error: NearestError) -> Self {
        match error {
            NearestError::Point(point) => point.into(),
            NearestError::Radius { .. } => Self::new(Reason::BadRadius, error.to_string()),
        }
    }
}
