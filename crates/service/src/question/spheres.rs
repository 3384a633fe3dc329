//! Do these spheres of the map frame meet voxels?

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
    Before, PlanningError, PlanningView, Sphere, SphereGroups, SphereQuestion, Surroundings,
};
use mrol_map::util::StopSignal;

/// Do these spheres of the map frame meet voxels?
#[derive(Debug, Clone, PartialEq)]
pub struct SphereCheck {
    /// What it has in common with other questions.
    pub asked: QuestionScope,
    /// The spheres, group by group.
    pub spheres: Vec<Sphere>,
    /// How many spheres each group has; a group is answered as one.
    pub sizes: Vec<u32>,
    /// What is added to all radii, meters.
    pub padding_m: f32,
    /// What counts.
    pub surroundings: Surroundings,
    /// How it is answered.
    pub answer: CheckAs,
}

/// How long a sphere takes, nanoseconds.
const NS_EACH: usize = 30;

impl SphereCheck {
    /// The answers to some of the groups, and how many they are; none once stopped.
    fn collisions(
        &self,
        view: &PlanningView<'_>,
        (groups, checked): (SphereGroups<'_>, usize),
        stop: StopSignal<'_>,
    ) -> Result<Option<Collisions>, PlanningError> {
        let (level, padding_m) = (self.asked.level, self.padding_m);
        let question = SphereQuestion { groups, padding_m, level, surroundings: &self.surroundings };
        Ok(match self.answer {
            CheckAs::Colliding => {
                view.spheres_meet(&question, stop)?.map(|words| Collisions::Colliding { words, checked })
            }
            CheckAs::FirstHit => view.first_sphere_hits(&question, stop)?.map(Collisions::FirstHits),
            CheckAs::Clearance { most_m } => {
                let most_m = clearance_most_m(view, level, most_m);
                view.sphere_clearances(&question, most_m, stop)?.map(Collisions::Clearances)
            }
        })
    }
}

impl Question for SphereCheck {
    type Answer = Collisions;

    const OPERATION: &'static str = "CheckSpheres";

    fn asked(&self) -> &QuestionScope {
        &self.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        self.sizes.len() * BYTES_EACH
    }

    fn work_ns(&self) -> usize {
        self.spheres.len().saturating_mul(NS_EACH)
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        check_ignored(self.surroundings.ignored.len(), limits)?;
        check_elements("spheres", self.spheres.len(), size_of::<Sphere>(), limits)?;
        check_elements("sizes", self.sizes.len(), BYTES_EACH, limits)?;
        limits.check_group_sizes(&self.sizes)?;
        SphereGroups::new(&self.spheres, &self.sizes)?;
        Ok(())
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        _: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(Collisions, ContentVersion), ServiceError> {
        let groups = SphereGroups::new(&self.spheres, &self.sizes)?;
        let view = || map.planning_view(&self.asked, &self.surroundings, stop);
        let of_group = self.spheres.len() / self.sizes.len().max(1);
        let pieces = Pieces::of(self.sizes.len(), of_group.max(1).saturating_mul(NS_EACH));
        pieces.answered(stop, view, |view, piece| {
            let checked = piece.len();
            let (groups, spheres) = groups.part(piece);
            let collisions = self.collisions(view, (groups, checked), stop);
            let before = Before { spheres, ..Before::default() };
            collisions.map_err(|error| error.behind(before))?.ok_or_else(|| ended_early(stop))
        })
    }

    fn check_known(&self, answer: &Collisions, known: &KnownPart) -> Result<(), ServiceError> {
        let groups = self.sizes.iter().enumerate().flat_map(|(i, size)| (0..*size).map(move |_| i));
        self.spheres.iter().enumerate().zip(groups).try_for_each(|((number, sphere), group)| {
            let radius_m = f64::from(sphere.radius_m) + f64::from(self.padding_m);
            let what = || format!("spheres[{number}]");
            known.check_ball(what, sphere.center_m.map(f64::from), radius_m + answer.clearance_m(group))
        })
    }
}
