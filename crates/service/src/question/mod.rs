//! Questions of planners: each is answered from a view of a whole map, the server's or a replica's.

mod check;
mod classify;
mod frontiers;
mod grid;
mod known;
mod motions;
mod nearest;
mod poses;
mod rays;
mod spheres;

pub use check::{CheckAs, Collisions};
pub use classify::ClassifyQuestion;
pub use frontiers::{FRONTIERS_MAX_DEFAULT, FrontierQuestion};
pub use grid::{GridQuestion, GridScope};
pub use known::KnownPart;
pub use motions::MotionCheck;
pub use nearest::NearestQuestion;
pub use poses::PoseCheck;
pub use rays::{RayQuestion, RaysToward};
pub use spheres::SphereCheck;

use std::fmt::Debug;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use uuid::Uuid;

use super::hosted_map::HostedMap;
use super::time_limit::TimeLimit;
use super::{
    Inner, Limits, MapService, MapVersion, Outcome, Reason, ServiceError, check_not_stopped, ended_early,
};
use mrol_map::map::{ContentVersion, MapName, MapView, MultiResolutionMap};
use mrol_map::planning::{Planner, PlanningView, Surroundings, Unknown};
use mrol_map::util::StopSignal;

/// What all questions have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Asked {
    /// The level of the voxels, 0 the finest.
    pub level: u32,
    /// Wait for this revision.
    pub min_revision: Option<u64>,
    /// The incarnation of the map that `min_revision` belongs to.
    pub map_uuid: Option<Uuid>,
    /// True where keep-outs do not count; otherwise they count as voxels do.
    pub ignore_keep_outs: bool,
}

/// A question of a planner.
pub trait Question: Debug + Send + Sync + 'static {
    /// What it is answered with.
    type Answer: Debug + Send + 'static;

    /// Its name in the table of operations.
    const OPERATION: &'static str;

    /// What it has in common with others.
    fn asked(&self) -> &Asked;

    /// Bytes of memory that its answer takes, at most.
    fn answer_bytes(&self, limits: &Limits) -> usize;

    /// Bytes of memory that finding the answer takes besides it, where that grows with the question.
    fn work_bytes(&self) -> usize {
        0
    }

    /// How long finding the answer takes, roughly, nanoseconds.
    fn work_ns(&self) -> usize;

    /// Checks it against the server's limits.
    ///
    /// # Errors
    /// `InvalidArgument`, naming the field, the value and the limit.
    fn check(&self, limits: &Limits) -> Result<(), ServiceError>;

    /// The answer from one view of `map`, with the version that it is of.
    ///
    /// # Errors
    /// `InvalidArgument` for what makes no question, naming the field and its place; how it was stopped, once it was; that the
    /// time is up, where `map` must not be waited for and would have to be.
    fn answer_from(
        &self,
        map: &QuestionedMap<'_>,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(Self::Answer, ContentVersion), ServiceError>;

    /// Refuses an answer that what is not known could change: it was given from a part of the map, and all keep-outs.
    ///
    /// # Errors
    /// `InvalidArgument`, naming the element that needs more, what it needs and what is known.
    fn check_known(&self, answer: &Self::Answer, known: &KnownPart) -> Result<(), ServiceError>;
}

/// A map that questions are asked of, and the planner of it, which is made when it is first needed.
#[derive(Debug, Clone, Copy)]
pub struct QuestionedMap<'a> {
    map: &'a Arc<MultiResolutionMap>,
    planner: &'a OnceLock<Planner>,
    field_bytes_max: usize,
    may_wait: bool,
}

impl<'a> QuestionedMap<'a> {
    /// The map, with a place for its planner, whose fields hold at most so many bytes.
    pub fn new(
        map: &'a Arc<MultiResolutionMap>,
        planner: &'a OnceLock<Planner>,
        field_bytes_max: usize,
    ) -> Self {
        Self { map, planner, field_bytes_max, may_wait: true }
    }

    /// The map for threads that may not wait: where a view of it has to be waited for, there is none.
    fn at_once(self) -> Self {
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
        asked: &Asked,
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
            // Who takes viewpoints may have to mend the fields by them.
            (false, Unknown::Occupied) => None,
        };
        view.ok_or_else(|| ended_early(stop))
    }

    /// A view of the whole map; none where it has to be waited for and must not be.
    fn view(&self, asked: &Asked) -> Option<MapView<'a>> {
        match (self.may_wait, asked.ignore_keep_outs) {
            (true, true) => Some(self.map.view().with_viewpoints()),
            (true, false) => Some(self.map.view().with_keep_outs().with_viewpoints()),
            (false, true) => self.map.try_view()?.try_with_viewpoints(),
            (false, false) => self.map.try_view()?.try_with_keep_outs()?.try_with_viewpoints(),
        }
    }

    /// The answer that `f` makes of a view of the whole map, with the view's version. Where there are many `elements`, changes
    /// are kept from beginning meanwhile, so that no shorter question queues behind a change that waits for this one.
    pub(super) fn in_view<A>(
        &self,
        asked: &Asked,
        elements: usize,
        stop: StopSignal<'_>,
        f: impl FnOnce(&MapView<'_>) -> Result<A, ServiceError>,
    ) -> Result<(A, ContentVersion), ServiceError> {
        let _long_read = (elements > SHORT_ELEMENTS && self.may_wait).then(|| self.map.long_read());
        let view = self.view(asked).ok_or_else(|| ended_early(stop))?;
        let answer = f(&view)?;
        check_not_stopped(stop)?;
        Ok((answer, view.version()))
    }
}

/// The answer to a question, with the state of the map that it is of.
#[derive(Debug, Clone, PartialEq)]
pub struct Answered<A> {
    /// The answer.
    pub answer: A,
    /// All of it is at this state.
    pub version: MapVersion,
}

/// Elements up to which a question is answered without keeping changes from beginning meanwhile: some milliseconds.
const SHORT_ELEMENTS: usize = 4096;

/// A question that is answered in about so long, nanoseconds, is answered where it arrives: handing it over takes two changes of
/// thread, some 70 us, and as many times as long as threads wait for a core.
const INLINE_NS: usize = 500_000;
/// How long that may take before the question is handed over after all.
const INLINE_TIME_MAX: Duration = Duration::from_millis(1);
/// Bytes that such a question takes at most: so little, once for each thread of the runtime, is not worth a look at the files in
/// which the system says how much memory there is.
const INLINE_BYTES: usize = 2 << 20;

/// Bytes of an answer up to which its question is checked where it arrives: some microseconds.
const CHECKED_INLINE_BYTES: usize = 64 << 10;

/// Whom memory is lent to, in refusals.
const ANSWER: &str = "the answer to a question";

impl MapService {
    /// Answers a question of a planner at one revision: a small one where it arrives, others on a thread for planners.
    ///
    /// # Errors
    /// `InvalidArgument` for what makes no question or is beyond a limit; `NotFound`; `DeadlineExceeded` when `min_revision`
    /// does not come; `FailedPrecondition` when the map has another uuid; `ResourceExhausted` where there is no memory for
    /// the answer, or too many jobs wait.
    pub async fn ask<Q: Question>(
        &self,
        map: &MapName,
        question: Q,
    ) -> Result<Answered<Q::Answer>, ServiceError> {
        let work = async {
            let map = self.map(map)?;
            let Asked { level, min_revision, map_uuid, .. } = *question.asked();
            let question = self.checked(question).await?;
            map.check_level(level)?;
            map.check_uuid(map_uuid)?;
            if let Some(revision) = min_revision {
                let wait_max = Duration::from_secs_f64(self.limits().min_revision_wait_max_s);
                map.wait_for_revision(revision, wait_max).await?;
            }
            if let Some(answer) = self.inner.answer_at_once(&map, &question) {
                return answer;
            }
            let inner = Arc::clone(&self.inner);
            let limit = TimeLimit::new("question_time_max", self.limits().question_time_max_s);
            let answer = move |stop: StopSignal<'_>| {
                let limits = &inner.settings.limits;
                let _lent = inner.budget.reserve_transient(bytes_of(&question, limits) as u64, ANSWER)?;
                limit.run(stop, |stop| map.answer_question(&map.questioned(limits), &question, limits, stop))
            };
            self.inner.pools.planning.run_for(&self.asker, answer).await?
        };
        self.observed(Q::OPERATION, Some(map), work, |_| Outcome::Read).await
    }

    /// A question within the limits: one that is neither small nor has a small answer is looked through on a thread for planners.
    async fn checked<Q: Question>(&self, question: Q) -> Result<Q, ServiceError> {
        if question.work_ns() <= INLINE_NS || question.answer_bytes(self.limits()) <= CHECKED_INLINE_BYTES {
            return question.check(self.limits()).map(|()| question);
        }
        let inner = Arc::clone(&self.inner);
        let check = move |_: StopSignal<'_>| question.check(&inner.settings.limits).map(|()| question);
        self.inner.pools.planning.run_for(&self.asker, check).await?
    }
}

impl Inner {
    /// The answer to a small question, where nothing has to be waited for and nobody waits for a thread; none elsewhere.
    fn answer_at_once<Q: Question>(
        &self,
        map: &HostedMap,
        question: &Q,
    ) -> Option<Result<Answered<Q::Answer>, ServiceError>> {
        let limits = &self.settings.limits;
        let is_small = question.work_ns() <= INLINE_NS && bytes_of(question, limits) <= INLINE_BYTES;
        if !is_small || self.pools.planning.is_wanted() {
            return None;
        }
        let stop = StopSignal::NEVER.by(Instant::now() + INLINE_TIME_MAX);
        let answer = map.answer_question(&map.questioned(limits).at_once(), question, limits, stop);
        let has_no_time = matches!(&answer, Err(error) if error.reason == Reason::TimeLimit);
        (!has_no_time).then_some(answer)
    }
}

/// Bytes of memory that a question takes, at most.
fn bytes_of<Q: Question>(question: &Q, limits: &Limits) -> usize {
    question.answer_bytes(limits).saturating_add(question.work_bytes())
}

impl HostedMap {
    fn questioned(&self, limits: &Limits) -> QuestionedMap<'_> {
        QuestionedMap::new(&self.map, &self.planner, limits.planning_field_bytes_max)
    }

    fn answer_question<Q: Question>(
        &self,
        questioned: &QuestionedMap<'_>,
        question: &Q,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<Answered<Q::Answer>, ServiceError> {
        let (answer, version) = question.answer_from(questioned, limits, stop)?;
        Ok(Answered { answer, version: self.version(version) })
    }
}

/// Refuses a question of more elements than one request may have, or of so many that the answer fits into no message.
fn check_elements(
    field: &str,
    elements: usize,
    bytes_each: usize,
    limits: &Limits,
) -> Result<(), ServiceError> {
    limits.check_elements(field, elements)?;
    let most = limits.message_bytes_max / bytes_each;
    if elements <= most {
        return Ok(());
    }
    let message = format!(
        "{field}: {elements} of them take {} bytes in the answer, message_bytes_max is {}: ask for at most {most}",
        elements * bytes_each,
        limits.message_bytes_max
    );
    Err(ServiceError::new(Reason::BatchTooLarge, message))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PointCloud, ServiceSettings};
    use mrol_map::geometry::Point;
    use mrol_map::map::{MapContents, MapSettings};
    use mrol_map::planning::{Body, Link, Sphere};
    use mrol_map::voxel::{VoxelKey, VoxelSet};
    use mrol_store::OpeningProgress;

    /// Does a ball fit at the origin?
    fn pose_check() -> PoseCheck {
        let spheres = vec![Sphere { center_m: [0.0; 3], radius_m: 0.1 }];
        PoseCheck {
            asked: Asked::default(),
            body: Arc::new(Body::new(vec![Link { spheres, ..Link::default() }]).unwrap()),
            configurations: vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            surroundings: Surroundings::ALL_VOXELS,
            answer: CheckAs::Colliding,
        }
    }

    /// Bytes that the fields of a map hold after a check where a voxel is near, when they may hold so many.
    fn field_bytes(field_bytes_max: usize) -> usize {
        let voxels = VoxelKey::new([3, 0, 0]).into_iter().collect();
        let map = MultiResolutionMap::restore(MapSettings::new(0.1, 1), MapContents::at(1, voxels)).unwrap();
        let check = pose_check();
        let (map, planner) = (Arc::new(map), OnceLock::new());
        let map = QuestionedMap::new(&map, &planner, field_bytes_max);
        let (answer, _) = check.answer_from(&map, &Limits::default(), StopSignal::NEVER).unwrap();
        assert_eq!(answer.words(), [0]);
        map.planner().field_bytes()
    }

    /// Rays that meet nothing.
    fn rays(count: usize) -> RayQuestion {
        let toward = RaysToward::Ends(PointCloud::from(vec![Point::new(1.0, 0.0, 5.0); count]));
        RayQuestion {
            asked: Asked::default(),
            origins: vec![Point::new(0.0, 0.0, 5.0)].into(),
            toward,
            unknown: Unknown::Free,
        }
    }

    #[tokio::test]
    async fn a_small_question_is_answered_where_it_arrives_once_nothing_has_to_be_waited_for() {
        let service = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        let name = MapName::new("a").unwrap();
        service.create_map(name.clone(), MapSettings::new(0.1, 1)).await.unwrap();
        let map = Arc::clone(&service.map(&name).unwrap().map);
        let put = |index| {
            map.committer().exchange(&VoxelSet::default(), &VoxelKey::new(index).into_iter().collect());
        };
        let handed_over =
            || service.pools().iter().find(|pool| pool.name == "planning").map_or(0, |pool| pool.begun);
        let ask = async || service.ask(&name, pose_check()).await.unwrap().answer.words();
        for (index, expected) in [([3, 0, 0], 0), ([1, 0, 0], 1)] {
            put(index);
            // The fields are to be made, or mended; what an answer did not wait for is made for the next one.
            let before = handed_over();
            assert_eq!(ask().await, [expected]);
            assert!(handed_over() > before);
            for _ in 0..8 {
                ask().await;
            }
            let made = handed_over();
            assert_eq!((ask().await, handed_over()), (vec![expected], made));
        }
        let before = handed_over();
        service.ask(&name, rays(1)).await.unwrap();
        assert_eq!(handed_over(), before);
        service.ask(&name, rays(5000)).await.unwrap();
        // A large one is checked there too.
        assert_eq!(handed_over(), before + 2);
        let mut wrong = pose_check();
        wrong.asked.level = 7;
        assert_eq!(service.ask(&name, wrong).await.unwrap_err().reason, Reason::LevelOutOfRange);
    }

    #[test]
    fn fields_hold_what_they_may_and_not_a_byte_more() {
        let needed = field_bytes(Limits::default().planning_field_bytes_max);
        assert!(needed > 512, "{needed}");
        assert_eq!(field_bytes(needed), needed);
        assert!(field_bytes(needed - 1) < needed);
        assert_eq!(field_bytes(0), 0);
    }
}
