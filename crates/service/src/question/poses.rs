//! Does a body fit at these configurations?

use std::sync::Arc;

use super::check::{BYTES_EACH, CheckAs, Collisions, check_ignored, clearance_most_m};
use super::known::KnownPart;
use super::pieces::Pieces;
use super::planner_question::{Question, check_elements};
use super::question_target::QuestionTarget;
use super::scope::QuestionScope;
use crate::error::ServiceError;
use crate::limits::Limits;
use crate::work::ended_early;
use mrol_map::map::ContentVersion;
use mrol_map::planning::{
    Before, Body, Configurations, NUMBERS_PER_POSE, PlanningError, PlanningView, PoseQuestion, Surroundings,
};
use mrol_map::util::StopSignal;

/// Does a body fit at these configurations?
#[derive(Debug, Clone, PartialEq)]
pub struct PoseCheck {
    /// What it has in common with other questions.
    pub asked: QuestionScope,
    /// The body.
    pub body: Arc<Body>,
    /// Poses of its links in the map frame, configuration by configuration, link by link, each x y z qx qy qz qw.
    pub configurations: Vec<f32>,
    /// What counts.
    pub surroundings: Surroundings,
    /// How it is answered.
    pub answer: CheckAs,
}

/// How long a part of the body takes in a configuration, nanoseconds; a bit more than where it is asked for a bit.
const NS_EACH: usize = 5;

impl PoseCheck {
    /// The answers to some of the configurations; none once stopped.
    fn collisions(
        &self,
        view: &PlanningView<'_>,
        configurations: Configurations<'_>,
        stop: StopSignal<'_>,
    ) -> Result<Option<Collisions>, PlanningError> {
        let level = self.asked.level;
        let question =
            PoseQuestion { body: &self.body, configurations, level, surroundings: &self.surroundings };
        Ok(match self.answer {
            CheckAs::Colliding => view
                .bodies_meet(&question, stop)?
                .map(|words| Collisions::Colliding { words, checked: configurations.len() }),
            CheckAs::FirstHit => view.first_hits(&question, stop)?.map(Collisions::FirstHits),
            CheckAs::Clearance { most_m } => {
                let most_m = clearance_most_m(view, level, most_m);
                view.clearances(&question, most_m, stop)?.map(Collisions::Clearances)
            }
        })
    }
}

impl Question for PoseCheck {
    type Answer = Collisions;

    const OPERATION: &'static str = "CheckPoses";

    fn asked(&self) -> &QuestionScope {
        &self.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        self.configurations.len() * BYTES_EACH
    }

    fn work_ns(&self) -> usize {
        let configurations = self.configurations.len() / (NUMBERS_PER_POSE * self.body.links().len());
        configurations.saturating_mul(self.body.parts()).saturating_mul(NS_EACH)
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        limits.check_body_parts(self.body.parts())?;
        check_ignored(self.surroundings.ignored.len(), limits)?;
        let configurations = Configurations::new(&self.configurations, self.body.links().len())?;
        check_elements("configurations", configurations.len(), BYTES_EACH, limits)
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        _: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(Collisions, ContentVersion), ServiceError> {
        let configurations = Configurations::new(&self.configurations, self.body.links().len())?;
        let view = || map.planning_view(&self.asked, &self.surroundings, stop);
        let pieces = Pieces::of(configurations.len(), self.body.parts().saturating_mul(NS_EACH));
        pieces.answered(stop, view, |view, piece| {
            let before = Before { configurations: piece.start, ..Before::default() };
            let collisions = self.collisions(view, configurations.part(piece), stop);
            collisions.map_err(|error| error.behind(before))?.ok_or_else(|| ended_early(stop))
        })
    }

    fn check_known(&self, answer: &Collisions, known: &KnownPart) -> Result<(), ServiceError> {
        let configurations = Configurations::new(&self.configurations, self.body.links().len())?;
        for i in 0..configurations.len() {
            let told_m = answer.clearance_m(i);
            self.body.placed(configurations, i).try_for_each(|part| {
                let what = || format!("configurations[{i}].links[{}]", part.link);
                known.check_ball(what, part.center_m, part.radius_m + told_m)
            })?;
        }
        Ok(())
    }
}
