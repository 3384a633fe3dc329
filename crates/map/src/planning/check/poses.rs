//! Does a body fit at these configurations?

use std::borrow::Cow;

use super::answer_kind::{AnswerKind, Clearances, FirstHits};
use super::configuration::{Configuration, StagedConfiguration};
use super::field_lookup::FieldLookup;
use super::pipeline::{Unanswered, answer_staged};
use super::rounds::Answerer;
use super::single_link::EightPlaces;
use crate::planning::answers::{Clearance, Hit};
use crate::planning::body::{Body, BodyInCells, Configurations, Reach};
use crate::planning::clearance::LANES;
use crate::planning::error::PlanningError;
use crate::planning::keep_outs::{Figure, Posed, Shapes};
use crate::planning::planner::PlanningView;
use crate::planning::unknown::Surroundings;
use crate::util::StopSignal;

/// Configurations between two checks of the stop signal.
const PER_STOP_CHECK: usize = 256;

/// A body at configurations.
#[derive(Debug, Clone, Copy)]
pub struct PoseQuestion<'a> {
    /// The body.
    pub body: &'a Body,
    /// Where it is asked about, in the map frame.
    pub configurations: Configurations<'a>,
    /// Level of the voxels that count.
    pub level: u32,
    /// What counts.
    pub surroundings: &'a Surroundings,
}

impl PlanningView<'_> {
    /// Says of each configuration whether the body meets a voxel: configuration i is bit i % 64 of word i / 64. None
    /// once stopped.
    ///
    /// # Errors
    /// For a level that the map has not, spheres that are too large for the level, and a part of the body beyond the
    /// map's lattice.
    pub fn bodies_meet(
        &self,
        question: &PoseQuestion<'_>,
        stop: StopSignal<'_>,
    ) -> Result<Option<Vec<u64>>, PlanningError> {
        let (body, cells_per_m) = self.in_cells(question, 0.0)?;
        let PoseQuestion { configurations, level, surroundings, .. } = *question;
        let meeting = Meeting { configurations, body: &body, cells_per_m };
        let meets = self.each(level, surroundings, (configurations.len(), PER_STOP_CHECK), stop, meeting);
        let words = meets.map(|meets| words(&meets));
        Ok(self.among_keep_outs_at(question, words, |posed, shapes, words| posed.mark(shapes, words, stop)))
    }

    /// What the body meets first in each configuration, where it meets something. None once stopped.
    ///
    /// # Errors
    /// As for [`PlanningView::bodies_meet`].
    pub fn first_hits(
        &self,
        question: &PoseQuestion<'_>,
        stop: StopSignal<'_>,
    ) -> Result<Option<Vec<Option<Hit>>>, PlanningError> {
        let hits = self.each_configuration(question, stop, (FirstHits, 0.0))?;
        Ok(self.among_keep_outs_at(question, hits, |posed, shapes, hits| posed.hits(shapes, hits, stop)))
    }

    /// How much room the body has in each configuration, up to `most_m` meters. None once stopped.
    ///
    /// # Errors
    /// As for [`PlanningView::bodies_meet`], and when `most_m` is more than
    /// [`CLEARANCE_CELLS_MAX`](crate::planning::CLEARANCE_CELLS_MAX) voxels.
    pub fn clearances(
        &self,
        question: &PoseQuestion<'_>,
        most_m: f32,
        stop: StopSignal<'_>,
    ) -> Result<Option<Vec<Clearance>>, PlanningError> {
        let clearances = Clearances::up_to(most_m, self.cells_per_m(question.level)?)?;
        let clearances = self.each_configuration(question, stop, (clearances, most_m))?;
        Ok(self.among_keep_outs_at(question, clearances, |posed, shapes, clearances| {
            posed.clearances(shapes, clearances, stop)
        }))
    }

    /// The answers that `mend` makes of those about voxels, where there are keep-outs that count.
    fn among_keep_outs_at<A>(
        &self,
        question: &PoseQuestion<'_>,
        answers: Option<A>,
        mend: impl FnOnce(Posed<'_>, &Shapes<'_>, A) -> Option<A>,
    ) -> Option<A> {
        let Some(shapes) = self.shapes() else { return answers };
        let figure = Figure::of(question.body.links());
        mend(Posed::Body(&figure, question.configurations), &shapes, answers?)
    }

    /// The body in cells of the level, and how many of them are a meter, for an answer about what is within `most_m` of
    /// the body.
    fn in_cells<'q>(
        &self,
        question: &PoseQuestion<'q>,
        most_m: f32,
    ) -> Result<(Cow<'q, BodyInCells>, f64), PlanningError> {
        let cells_per_m = self.cells_per_m(question.level)?;
        question.configurations.check_links(question.body.links().len())?;
        let body = question.body.in_cells(cells_per_m)?;
        Reach::of(self.lattice(), cells_per_m, question.surroundings, most_m)
            .check_poses(&body, &question.configurations)?;
        Ok((body, cells_per_m))
    }

    fn each_configuration<K: AnswerKind>(
        &self,
        question: &PoseQuestion<'_>,
        stop: StopSignal<'_>,
        (kind, most_m): (K, f32),
    ) -> Result<Option<Vec<K::Answer>>, PlanningError> {
        let (body, cells_per_m) = self.in_cells(question, most_m)?;
        let PoseQuestion { configurations, level, surroundings, .. } = *question;
        let chunks = (configurations.len(), PER_STOP_CHECK);
        let poses = Poses { configurations, kind, configuration: Configuration::new(&body, cells_per_m) };
        Ok(self.each(level, surroundings, chunks, stop, poses))
    }
}

/// Answers configuration by configuration.
struct Poses<'a, K> {
    configurations: Configurations<'a>,
    kind: K,
    configuration: Configuration<'a>,
}

impl<K: AnswerKind> Answerer for Poses<'_, K> {
    type Answer = K::Answer;

    #[inline(always)]
    fn answer(&mut self, lookup: &mut FieldLookup<'_>, item: usize) -> Option<K::Answer> {
        self.configuration.place(self.configurations.poses_of(item));
        self.kind.answer(&mut self.configuration, lookup)
    }
}

/// Says of each configuration whether the body meets a voxel.
struct Meeting<'a> {
    configurations: Configurations<'a>,
    body: &'a BodyInCells,
    cells_per_m: f64,
}

impl Answerer for Meeting<'_> {
    type Answer = bool;

    #[inline(always)]
    fn answer(&mut self, lookup: &mut FieldLookup<'_>, item: usize) -> Option<bool> {
        let mut configuration = Configuration::new(self.body, self.cells_per_m);
        configuration.place(self.configurations.poses_of(item));
        configuration.meets(lookup)
    }

    #[inline(always)]
    fn answer_all(&mut self, lookup: &mut FieldLookup<'_>, first: usize, answers: &mut [Option<bool>]) {
        let items: Vec<usize> = (0..answers.len()).filter(|&item| answers[item].is_none()).collect();
        let unanswered = Unanswered { configurations: self.configurations, first, items: &items };
        match &self.body.links[..] {
            [link] => {
                let new = || EightPlaces::new((link, &self.body.singles), self.cells_per_m, unanswered);
                answer_staged(lookup, items.len().div_ceil(LANES), new, answers);
            }
            _ => {
                let new = || StagedConfiguration::new(self.body, self.cells_per_m, unanswered);
                answer_staged(lookup, items.len(), new, answers);
            }
        }
    }
}

/// Bits in words, the first in the lowest of the first word.
pub(super) fn words(bits: &[bool]) -> Vec<u64> {
    let word = |bits: &[bool]| (0..).zip(bits).fold(0, |word, (n, bit)| word | u64::from(*bit) << n);
    bits.chunks(64).map(word).collect()
}
