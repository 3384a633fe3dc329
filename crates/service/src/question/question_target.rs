//! A map that questions are asked of, the server's or a replica's.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use super::pieces::WholeView;
use super::scope::QuestionScope;
use crate::error::ServiceError;
use crate::limits::Limits;
use crate::work::{TimeLimit, check_not_stopped, ended_early};
use mrol_map::map::{ContentVersion, MapView, MultiResolutionMap, PausingView};
use mrol_map::planning::{Planner, PlanningView, Surroundings, Unknown};
use mrol_map::util::StopSignal;

/// Elements up to which a question is answered without keeping changes from beginning meanwhile: some milliseconds.
const SHORT_ELEMENTS: usize = 4096;

/// A map that questions are asked of, and the planner of it, which is made when it is first needed.
#[derive(Debug, Clone, Copy)]
pub struct QuestionTarget<'a> {
    map: &'a Arc<MultiResolutionMap>,
    planner: &'a OnceLock<Planner>,
    field_bytes_max: usize,
    may_wait: bool,
}

impl<'a> QuestionTarget<'a> {
    /// The map, with a place for its planner, whose fields hold at most so many bytes.
    pub fn new(
        map: &'a Arc<MultiResolutionMap>,
        planner: &'a OnceLock<Planner>,
        field_bytes_max: usize,
    ) -> Self {
        Self { map, planner, field_bytes_max, may_wait: true }
    }

    /// The map for threads that may not wait: where a view of it has to be waited for, there is none.
    pub(super) fn at_once(self) -> Self {
        Self { may_wait: false, ..self }
    }

    /// The planner, which keeps what makes checks of bodies fast.
    pub(super) fn planner(&self) -> &'a Planner {
        self.planner.get_or_init(|| Planner::with_field_bytes(Arc::clone(self.map), self.field_bytes_max))
    }

    /// A view of the whole map for checks of bodies among what counts.
    ///
    /// # Errors
    /// How the question was stopped: also where the view has to be waited for and must not be.
    pub(super) fn planning_view(
        &self,
        asked: &QuestionScope,
        surroundings: &Surroundings,
        stop: StopSignal<'_>,
    ) -> Result<PlanningView<'a>, ServiceError> {
        let counts_keep_outs = !asked.ignore_keep_outs;
        let view = match (self.may_wait, surroundings.unknown) {
            (true, unknown) => {
                let view = self.planner().view();
                let view = if counts_keep_outs { view.with_keep_outs() } else { view };
                Some(if unknown == Unknown::Occupied { view.with_viewpoints() } else { view })
            }
            (false, Unknown::Free) => {
                let view = self.planner.get().and_then(Planner::try_view);
                view.and_then(|view| if counts_keep_outs { view.try_with_keep_outs() } else { Some(view) })
            }
            // Taking viewpoints may take mending the fields by them.
            (false, Unknown::Occupied) => None,
        };
        view.ok_or_else(|| ended_early(stop))
    }

    /// A view of the whole map; none where it has to be waited for and must not be.
    fn view(&self, asked: &QuestionScope) -> Option<MapView<'a>> {
        match (self.may_wait, asked.ignore_keep_outs) {
            (true, true) => Some(self.map.view().with_viewpoints()),
            (true, false) => Some(self.map.view().with_keep_outs().with_viewpoints()),
            (false, true) => self.map.try_view()?.try_with_viewpoints(),
            (false, false) => self.map.try_view()?.try_with_keep_outs()?.try_with_viewpoints(),
        }
    }

    /// A view of the whole map for a question of so many `elements`; where these are many, it keeps changes from
    /// beginning meanwhile, so that no shorter question queues behind a change that waits for this one.
    ///
    /// # Errors
    /// How the question was stopped: also where the view has to be waited for and must not be.
    pub(super) fn whole_view(
        &self,
        asked: &QuestionScope,
        elements: usize,
        stop: StopSignal<'_>,
    ) -> Result<WholeView<'a>, ServiceError> {
        let map: &'a MultiResolutionMap = self.map;
        let _long_read = (elements > SHORT_ELEMENTS && self.may_wait).then(|| map.long_read());
        let view = self.view(asked).ok_or_else(|| ended_early(stop))?;
        Ok(WholeView { view, _long_read })
    }

    /// A view of the whole map for a question that takes long, which lets others go first between its parts.
    pub(super) fn pausing_view(&self, asked: &QuestionScope) -> PausingView<'a> {
        PausingView::during(self.map.long_read(), !asked.ignore_keep_outs, true)
    }

    /// The answer that `f` makes of a view of the whole map, with the view's version. Where there are many `elements`,
    /// changes are kept from beginning meanwhile, so that no shorter question queues behind a change that waits for
    /// this one.
    pub(super) fn in_view<A>(
        &self,
        asked: &QuestionScope,
        elements: usize,
        stop: StopSignal<'_>,
        f: impl FnOnce(&MapView<'_>) -> Result<A, ServiceError>,
    ) -> Result<(A, ContentVersion), ServiceError> {
        let WholeView { view, _long_read } = self.whole_view(asked, elements, stop)?;
        let answer = f(&view)?;
        check_not_stopped(stop)?;
        Ok((answer, view.version()))
    }

    /// The answers that `f` makes of parts of so many `elements`, each in a view of the whole map as it is then and
    /// within `question_time_max_s`, with the version of the first. Between them changes may begin, and other work goes
    /// first.
    pub(super) fn in_parts<A>(
        &self,
        asked: &QuestionScope,
        (elements, of_part): (usize, usize),
        limits: &Limits,
        stop: StopSignal<'_>,
        mut f: impl FnMut(&MapView<'_>, Range<usize>, StopSignal<'_>) -> Result<A, ServiceError>,
    ) -> Result<(Vec<A>, ContentVersion), ServiceError> {
        let (mut answers, mut first) = (Vec::new(), None);
        // One part of a question of nothing, too: its answer has a version.
        for start in (0..elements.max(1)).step_by(of_part) {
            stop.give_way();
            check_not_stopped(stop)?;
            let limit = TimeLimit::new("question_time_max", limits.question_time_max_s);
            let range = start..elements.min(start + of_part);
            let (answer, version) = limit
                .run(stop, |stop| self.in_view(asked, range.len(), stop, |view| f(view, range, stop)))?;
            answers.push(answer);
            first.get_or_insert(version);
        }
        let version = first.unwrap_or_else(|| self.map.content_version());
        Ok((answers, version))
    }
}
