//! Can a body move along these configurations?

use std::sync::Arc;

use super::check::{check_ignored, check_parts};
use super::{Asked, Question, QuestionedMap, check_elements};
use crate::map::ContentVersion;
use crate::planning::{Body, Configurations, MotionAnswer, MotionQuestion, Surroundings};
use crate::service::{Limits, ServiceError, check_not_stopped};
use crate::util::StopSignal;

/// Can a body move along these configurations?
#[derive(Debug, Clone, PartialEq)]
pub struct MotionCheck {
    /// What it has in common with other questions.
    pub asked: Asked,
    /// The body.
    pub body: Arc<Body>,
    /// The configurations of all motions, one after the other, as those of a [`PoseCheck`](super::PoseCheck).
    pub configurations: Vec<f32>,
    /// How many configurations each motion has: two or more.
    pub lengths: Vec<u32>,
    /// How far a point of the body moves from one check to the next at most, meters; half a voxel of the level without.
    pub step_m: Option<f32>,
    /// Up to where the least clearance of each motion is told, meters; it is not told without.
    pub clearance_max_m: Option<f32>,
    /// What counts.
    pub surroundings: Surroundings,
}

/// Bytes of a motion in an answer: a share, a clearance, and a bit.
const BYTES_EACH: usize = 9;

impl Question for MotionCheck {
    type Answer = Vec<MotionAnswer>;

    const OPERATION: &'static str = "CheckMotions";

    fn asked(&self) -> &Asked {
        &self.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        self.lengths.len() * BYTES_EACH
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        check_parts("body", self.body.parts(), limits)?;
        check_ignored(self.surroundings.ignored.len(), limits)?;
        let configurations = Configurations::new(&self.configurations, self.body.links().len())?;
        check_elements("configurations", configurations.len(), BYTES_EACH, limits)?;
        check_elements("lengths", self.lengths.len(), BYTES_EACH, limits)
    }

    fn answer_from(
        &self,
        map: &QuestionedMap<'_>,
        _: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(Vec<MotionAnswer>, ContentVersion), ServiceError> {
        let configurations = Configurations::new(&self.configurations, self.body.links().len())?;
        let question = MotionQuestion {
            body: &self.body,
            configurations,
            lengths: &self.lengths,
            step_m: self.step_m,
            clearance_max_m: self.clearance_max_m,
            level: self.asked.level,
            surroundings: &self.surroundings,
        };
        let view = map.planner().view();
        let answers = view.check_motions(&question, stop)?;
        check_not_stopped(stop)?;
        answers.map(|answers| (answers, view.version())).ok_or_else(|| super::ended_early(stop))
    }
}
