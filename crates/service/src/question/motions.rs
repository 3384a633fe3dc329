//! Can a body move along these configurations?

use std::sync::Arc;

use super::check::check_ignored;
use super::known::KnownPart;
use super::pieces::Pieces;
use super::planner_question::{Question, check_elements};
use super::question_target::QuestionTarget;
use super::scope::QuestionScope;
use crate::error::ServiceError;
use crate::limits::Limits;
use crate::work::ended_early;
use mrol_map::map::{ContentVersion, MultiResolutionMap};
use mrol_map::planning::{
    Before, Body, Configurations, MotionAnswer, MotionQuestion, NUMBERS_PER_POSE, Surroundings,
    prepared_bytes,
};
use mrol_map::util::StopSignal;

/// Can a body move along these configurations?
#[derive(Debug, Clone, PartialEq)]
pub struct MotionCheck {
    /// What it has in common with other questions.
    pub asked: QuestionScope,
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
/// How long a part of the body takes at the ends of a motion and between them, for each configuration, nanoseconds:
/// where it moves some ten voxels.
const NS_EACH: usize = 30;

impl Question for MotionCheck {
    type Answer = Vec<MotionAnswer>;

    const OPERATION: &'static str = "CheckMotions";

    fn asked(&self) -> &QuestionScope {
        &self.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        self.lengths.len() * BYTES_EACH
    }

    fn work_bytes(&self, _: &MultiResolutionMap) -> usize {
        let (links, poses) = (self.body.links().len(), self.configurations.len() / NUMBERS_PER_POSE);
        prepared_bytes(self.lengths.len(), poses / links, links)
    }

    fn work_ns(&self) -> usize {
        let configurations = self.configurations.len() / (NUMBERS_PER_POSE * self.body.links().len());
        configurations.saturating_mul(self.body.parts()).saturating_mul(NS_EACH)
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        limits.check_body_parts(self.body.parts())?;
        check_ignored(self.surroundings.ignored.len(), limits)?;
        let configurations = Configurations::new(&self.configurations, self.body.links().len())?;
        check_elements("configurations", configurations.len(), BYTES_EACH, limits)?;
        check_elements("lengths", self.lengths.len(), BYTES_EACH, limits)
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        _: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(Vec<MotionAnswer>, ContentVersion), ServiceError> {
        let configurations = Configurations::new(&self.configurations, self.body.links().len())?;
        let all = MotionQuestion {
            body: &self.body,
            configurations,
            lengths: &self.lengths,
            step_m: self.step_m,
            clearance_max_m: self.clearance_max_m,
            level: self.asked.level,
            surroundings: &self.surroundings,
        };
        all.check_lengths()?;
        let motions = self.lengths.len();
        let view = || map.planning_view(&self.asked, &self.surroundings, stop);
        let pieces = Pieces::of_large(motions, self.work_ns() / motions.max(1));
        let mut first = 0;
        pieces.answered(stop, view, |view, piece| {
            let before = Before { configurations: first, motions: piece.start, ..Before::default() };
            let lengths = &self.lengths[piece];
            let end = first + lengths.iter().map(|length| *length as usize).sum::<usize>();
            let part = MotionQuestion { configurations: configurations.part(first..end), lengths, ..all };
            first = end;
            let answers = view.check_motions(&part, stop).map_err(|error| error.behind(before))?;
            answers.ok_or_else(|| ended_early(stop))
        })
    }

    fn check_known(&self, answer: &Vec<MotionAnswer>, known: &KnownPart) -> Result<(), ServiceError> {
        let configurations = Configurations::new(&self.configurations, self.body.links().len())?;
        let mut first = 0;
        for (length, motion) in self.lengths.iter().zip(answer) {
            let end = first + *length as usize;
            let told_m = f64::from(motion.clearance_m.unwrap_or_default());
            for i in first..end {
                // The region is convex: what is known at both ends is known between them, but for the turn of a link.
                let turns = [i.checked_sub(1).filter(|from| *from >= first), (i + 1 < end).then_some(i)];
                self.body.placed(configurations, i).try_for_each(|part| {
                    let strays = |from: usize| self.body.strays_m(configurations, from, part.link);
                    let strays_m = turns.into_iter().flatten().map(strays).fold(0.0, f64::max);
                    let what = || format!("configurations[{i}].links[{}]", part.link);
                    known.check_ball(what, part.center_m, part.radius_m + strays_m + told_m)
                })?;
            }
            first = end;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::geometry::Point;
    use mrol_map::map::MapSettings;
    use mrol_map::planning::Link;

    #[test]
    fn what_is_made_of_motions_counts_before_it_is_made() {
        let check = |motions: usize| MotionCheck {
            asked: QuestionScope::default(),
            body: Arc::new(
                Body::new(vec![Link { points: vec![Point::new(0.0, 0.0, 0.0)], ..Link::default() }]).unwrap(),
            ),
            configurations: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].repeat(2 * motions),
            lengths: vec![2; motions],
            step_m: None,
            clearance_max_m: None,
            surroundings: Surroundings::default(),
        };
        // Two ways of a link, of two poses each, and their lists.
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 1)).unwrap();
        let bytes = |motions| check(motions).work_bytes(&map);
        assert!(bytes(1000) > 1000 * 2 * 128, "{}", bytes(1000));
        assert_eq!(bytes(2000), 2 * bytes(1000));
    }
}
