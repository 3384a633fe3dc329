//! Answers in three stages: while one is given, what the next two need of the field is on its way from memory.

use super::field_lookup::FieldLookup;
use crate::planning::body::{Configurations, NUMBERS_PER_POSE};

/// Stages of an answer, and so answers under way.
const STAGES: usize = 3;

/// Configurations that have no answer yet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unanswered<'a, 'o> {
    pub(super) configurations: Configurations<'a>,
    /// The configuration that item 0 is.
    pub(super) first: usize,
    pub(super) items: &'o [usize],
}

impl<'a> Unanswered<'a, '_> {
    /// The poses of the links in one of them.
    #[inline(always)]
    pub(super) fn poses_of(&self, place: usize) -> &'a [[f32; NUMBERS_PER_POSE]] {
        self.configurations.poses_of(self.first + self.items[place])
    }
}

/// A part of what is unanswered, which goes through the stages as one.
pub(super) trait Staged<'f> {
    /// Begins with the part of this number: finds what is looked at first.
    fn begin(&mut self, lookup: &mut FieldLookup<'f>, part: usize);

    /// Reads that, and finds what is looked at then.
    fn go_on(&mut self, lookup: &mut FieldLookup<'f>);

    /// Reads the rest, and answers by item; nothing where a part of the field is waited for.
    fn end(&mut self, lookup: &mut FieldLookup<'f>, answers: &mut [Option<bool>]);
}

/// Takes so many parts through the stages.
#[inline(always)]
pub(super) fn answer_staged<'f, P: Staged<'f>>(
    lookup: &mut FieldLookup<'f>,
    parts: usize,
    new: impl Fn() -> P,
    answers: &mut [Option<bool>],
) {
    let mut under_way: [P; STAGES] = std::array::from_fn(|_| new());
    for step in 0..parts + STAGES - 1 {
        if lookup.is_over() {
            return;
        }
        if step < parts {
            under_way[step % STAGES].begin(lookup, step);
        }
        if let Some(part) = step.checked_sub(1).filter(|part| *part < parts) {
            under_way[part % STAGES].go_on(lookup);
        }
        if let Some(part) = step.checked_sub(2) {
            under_way[part % STAGES].end(lookup, answers);
        }
    }
}
