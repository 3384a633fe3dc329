//! How the server answers a question: where it arrives, or on a thread for planners.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::planner_question::Question;
use super::question_target::QuestionTarget;
use super::scope::{AtVersion, QuestionScope};
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::map_service::{Inner, MapService};
use crate::maps::HostedMap;
use crate::observer::Outcome;
use crate::work::TimeLimit;
use mrol_map::map::{MapName, MultiResolutionMap};
use mrol_map::util::StopSignal;

/// A question that is answered in about so long, nanoseconds, is answered where it arrives: handing it over takes two
/// changes of thread, some 70 us, and as many times as long as threads wait for a core.
const INLINE_NS: usize = 500_000;
/// How long that may take before the question is handed over after all.
const INLINE_TIME_MAX: Duration = Duration::from_millis(1);
/// Bytes that such a question takes at most: so little, once for each thread of the runtime, is not worth a look at the
/// files in which the system says how much memory there is.
const INLINE_BYTES: usize = 2 << 20;

/// Bytes of an answer up to which its question is checked where it arrives: some microseconds.
const CHECKED_INLINE_BYTES: usize = 64 << 10;

/// Name under which the memory is reserved, for refusals.
const ANSWER: &str = "the answer to a question";

impl MapService {
    /// Answers a question of a planner at the state that it names, see [`AtVersion`]: a small one where it arrives,
    /// others on a thread for planners.
    ///
    /// # Errors
    /// `InvalidArgument` for what makes no question or is beyond a limit; `NotFound`; `DeadlineExceeded` when
    /// `min_revision` does not come; `FailedPrecondition` when the map has another uuid; `ResourceExhausted` where
    /// there is no memory for the answer, or too many jobs wait.
    pub async fn ask<Q: Question>(
        &self,
        map: &MapName,
        question: Q,
    ) -> Result<AtVersion<Q::Answer>, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            let QuestionScope { level, min_revision, map_uuid, .. } = *question.asked();
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
            let limits = self.limits();
            let limit = match question.is_in_parts() {
                true => TimeLimit::new("long_question_time_max", limits.long_question_time_max_s),
                false => TimeLimit::new("question_time_max", limits.question_time_max_s),
            };
            let answer = move |stop: StopSignal<'_>| {
                let limits = &inner.settings.limits;
                let bytes = bytes_of(&question, &map.map, limits);
                let _reserved = inner.budget.reserve_transient(bytes as u64, ANSWER)?;
                let answer = |stop: StopSignal<'_>| {
                    map.answer_question(&map.questioned(limits), &question, limits, stop)
                };
                limit.run(stop, answer).map_err(|error| with_way_out(error, Q::WAY_OUT))
            };
            self.inner.lanes.planning.run(&self.asker, answer).await?
        };
        self.observed(Q::OPERATION, Some(map), work, |_| Outcome::Read).await
    }

    /// A question within the limits: one that is neither small nor has a small answer is looked through on a thread for
    /// planners.
    async fn checked<Q: Question>(&self, question: Q) -> Result<Q, ServiceError> {
        if question.work_ns() <= INLINE_NS || question.answer_bytes(self.limits()) <= CHECKED_INLINE_BYTES {
            return question.check(self.limits()).map(|()| question);
        }
        let inner = Arc::clone(&self.inner);
        let check = move |_: StopSignal<'_>| question.check(&inner.settings.limits).map(|()| question);
        self.inner.lanes.planning.run(&self.asker, check).await?
    }
}

impl Inner {
    /// The answer to a small question, where nothing has to be waited for and nobody waits for a thread; none
    /// elsewhere.
    fn answer_at_once<Q: Question>(
        &self,
        map: &HostedMap,
        question: &Q,
    ) -> Option<Result<AtVersion<Q::Answer>, ServiceError>> {
        let limits = &self.settings.limits;
        let is_small =
            question.work_ns() <= INLINE_NS && bytes_of(question, &map.map, limits) <= INLINE_BYTES;
        if !is_small || self.lanes.planning.is_wanted() {
            return None;
        }
        let stop = StopSignal::NEVER.by(Instant::now() + INLINE_TIME_MAX);
        let answer = map.answer_question(&map.questioned(limits).at_once(), question, limits, stop);
        let has_no_time = matches!(&answer, Err(error) if error.reason == Reason::TimeLimit);
        (!has_no_time).then_some(answer)
    }
}

/// The error; where the time is up, it says what to do.
fn with_way_out(error: ServiceError, way_out: &str) -> ServiceError {
    match error.reason {
        Reason::TimeLimit => ServiceError { message: format!("{}: {way_out}", error.message), ..error },
        _ => error,
    }
}

/// Bytes of memory that a question about a map takes, at most.
fn bytes_of<Q: Question>(question: &Q, map: &MultiResolutionMap, limits: &Limits) -> usize {
    question.answer_bytes(limits).saturating_add(question.work_bytes(map))
}

impl HostedMap {
    fn questioned(&self, limits: &Limits) -> QuestionTarget<'_> {
        QuestionTarget::new(&self.map, &self.planner, limits.planning_field_bytes_max)
    }

    fn answer_question<Q: Question>(
        &self,
        questioned: &QuestionTarget<'_>,
        question: &Q,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<AtVersion<Q::Answer>, ServiceError> {
        let (answer, version) = question.answer_from(questioned, limits, stop)?;
        Ok(AtVersion { answer, version: self.version(version) })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use super::*;
    use crate::question::check::CheckAs;
    use crate::question::poses::PoseCheck;
    use crate::question::rays::{RayQuestion, RaysToward};
    use crate::request::PointCloud;
    use crate::settings::ServiceSettings;
    use mrol_map::geometry::Point;
    use mrol_map::map::{MapContents, MapSettings};
    use mrol_map::planning::{Body, Link, Sphere, Surroundings, Unknown};
    use mrol_map::voxel::{VoxelKey, VoxelSet};
    use mrol_store::OpeningProgress;

    /// Does a ball fit at the origin?
    fn pose_check() -> PoseCheck {
        let spheres = vec![Sphere { center_m: [0.0; 3], radius_m: 0.1 }];
        PoseCheck {
            asked: QuestionScope::default(),
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
        let map = QuestionTarget::new(&map, &planner, field_bytes_max);
        let (answer, _) = check.answer_from(&map, &Limits::default(), StopSignal::NEVER).unwrap();
        assert_eq!(answer.words(), [0]);
        map.planner().field_bytes()
    }

    /// Rays that meet nothing.
    fn rays(count: usize) -> RayQuestion {
        let toward = RaysToward::Ends(PointCloud::from(vec![Point::new(1.0, 0.0, 5.0); count]));
        RayQuestion {
            asked: QuestionScope::default(),
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
        let map = Arc::clone(&service.map(&name).await.unwrap().map);
        let put = |index| {
            map.committer().exchange(&VoxelSet::default(), &VoxelKey::new(index).into_iter().collect());
        };
        let handed_over =
            || service.lanes().iter().find(|lane| lane.name == "planning").map_or(0, |lane| lane.begun);
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
