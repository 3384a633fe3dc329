//! Points as what is known of them: occupied, free, or unknown.

use super::asked::Asked;
use super::known::KnownPart;
use super::planner_question::{Question, check_elements};
use super::questioned_map::QuestionedMap;
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::request::PointCloud;
use mrol_map::map::ContentVersion;
use mrol_map::planning::{OutOfRange, PointStates, classify_points};
use mrol_map::util::StopSignal;

/// Are these points occupied, free, or unknown?
#[derive(Debug, Clone, PartialEq)]
pub struct ClassifyQuestion {
    /// What it has in common with other questions.
    pub asked: Asked,
    /// The points, meters in the map frame.
    pub points: PointCloud,
}

/// Points of which two bits each are a byte.
const POINTS_A_BYTE: usize = 4;

impl Question for ClassifyQuestion {
    type Answer = PointStates;

    const OPERATION: &'static str = "ClassifyPoints";

    fn asked(&self) -> &Asked {
        &self.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        self.points.len().div_ceil(POINTS_A_BYTE) + 2 * size_of::<u64>()
    }

    fn work_ns(&self) -> usize {
        // How many viewpoints are asked of a point the question does not tell.
        usize::MAX
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        check_elements("points", self.points.len(), 1, limits)
    }

    fn answer_from(
        &self,
        map: &QuestionedMap<'_>,
        _: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(PointStates, ContentVersion), ServiceError> {
        let Self { asked, points } = self;
        map.in_view(asked, points.len(), stop, |view| {
            Ok(classify_points(view, points.as_slice(), asked.level, stop)?)
        })
    }

    fn check_known(&self, _: &PointStates, known: &KnownPart) -> Result<(), ServiceError> {
        let mut points = self.points.as_slice().iter().enumerate();
        points.try_for_each(|(i, point)| {
            known.check_ball(|| format!("points[{i}]"), point.xyz().map(f64::from), 0.0)
        })
    }
}

impl From<OutOfRange> for ServiceError {
    fn from(error: OutOfRange) -> Self {
        let reason = if error.point.is_finite() { Reason::PointOutOfRange } else { Reason::PointNotFinite };
        Self::new(reason, error.to_string())
    }
}
