//! Answering the items of a question in rounds: what a round lacks of the field is made before the next.

use super::field_lookup::FieldLookup;
use crate::planning::clearance::Fields;
use crate::planning::planner::PlanningView;
use crate::planning::simd::{self, Work};
use crate::planning::unknown::Surroundings;
use crate::util::StopSignal;

/// Times that a question is asked again for what was not made; then the voxels answer.
const ROUNDS_MAX: usize = 3;
/// The same for what there was no room to make at once, which may be more than the fields may hold.
const FULL_ROUNDS_MAX: usize = 64;

/// Answers items of a question one by one.
pub(super) trait Answerer {
    /// The answer of an item.
    type Answer;

    /// The answer of the item; none where it waits for a part of the field that is not made: it is asked again when
    /// that is. In the last round ([`FieldLookup::is_last`]) it always answers, unless the question is to end.
    fn answer(&mut self, lookup: &mut FieldLookup<'_>, item: usize) -> Option<Self::Answer>;

    /// Answers the items from `first` on that have no answer yet.
    #[inline(always)]
    fn answer_all(
        &mut self,
        lookup: &mut FieldLookup<'_>,
        first: usize,
        answers: &mut [Option<Self::Answer>],
    ) {
        for (item, answer) in answers.iter_mut().enumerate().filter(|(_, answer)| answer.is_none()) {
            if lookup.is_over() {
                return;
            }
            *answer = self.answer(lookup, first + item);
        }
    }
}

/// Items that are answered between two checks of the stop signal, those of them that have no answer yet.
struct Chunk<'a, 'l, A: Answerer> {
    answerer: &'a mut A,
    lookup: &'a mut FieldLookup<'l>,
    first: usize,
    answers: &'a mut [Option<A::Answer>],
}

impl<A: Answerer> Work for Chunk<'_, '_, A> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.answerer.answer_all(self.lookup, self.first, self.answers);
    }
}

impl PlanningView<'_> {
    /// Answers `count` items, `per_stop_check` of them at a time, between two checks of the stop signal; none once
    /// stopped, or where it may not wait and would have to.
    pub(super) fn each<A: Answerer>(
        &self,
        level: u32,
        surroundings: &Surroundings,
        (count, per_stop_check): (usize, usize),
        stop: StopSignal<'_>,
        mut answerer: A,
    ) -> Option<Vec<A::Answer>> {
        let mut answers: Vec<Option<A::Answer>> = Vec::with_capacity(count);
        answers.resize_with(count, || None);
        for (chunk, answers) in answers.chunks_mut(per_stop_check).enumerate() {
            let (mut rounds, mut full_rounds) = (0, 0);
            while answers.iter().any(Option::is_none) {
                if stop.is_stopped() {
                    return None;
                }
                let fields = self.fields()?;
                // The viewpoints may have changed since this view took them, by a change that touched no voxel.
                let is_of_view = self.holds(&fields, surroundings.unknown);
                let own = (!is_of_view).then(|| Fields::new(self.planner.map.block_levels_end() + 1, 0));
                let is_last = rounds + 1 >= ROUNDS_MAX || full_rounds >= FULL_ROUNDS_MAX || !is_of_view;
                let of_view = own.as_ref().unwrap_or(&fields);
                let mut lookup = FieldLookup::new(&self.view, surroundings, level, of_view, is_last, stop);
                let first = chunk * per_stop_check;
                simd::run(Chunk { answerer: &mut answerer, lookup: &mut lookup, first, answers });
                if lookup.is_stopped() {
                    return None;
                }
                *(if lookup.is_full() { &mut full_rounds } else { &mut rounds }) += 1;
                let unmade = lookup.into_unmade();
                drop(fields);
                if !self.may_wait && !unmade.is_empty() {
                    return None;
                }
                self.make(unmade, surroundings.unknown, stop);
            }
        }
        answers.into_iter().collect()
    }
}
