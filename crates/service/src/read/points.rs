//! Which points are occupied: queries of points, answered from a view of a map, the server's or a replica's.

use std::sync::Arc;
use std::time::Duration;

use uuid::Uuid;

use crate::error::ServiceError;
use crate::limits::Limits;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::Outcome;
use crate::request::{MapVersion, PointAnswer, PointQuery, bitmap, point_without_voxel};
use crate::work::check_not_stopped;
use mrol_map::geometry::Pose;
use mrol_map::map::{ContentVersion, LongRead, MapName, MapView};
use mrol_map::util::StopSignal;
use mrol_map::voxel::Lattice;

/// Queries of up to this many points, a tenth of a turn of a spinning sensor, are answered where they arrive: handing
/// them over, with two wake-ups, takes some 70 us, and answering them 15 to 100 where the look-up is as wide as a
/// machine of now allows.
const INLINE_POINTS: usize = 10_240;
/// Sides of keep-outs that points are compared with where they arrive, less than a millisecond; see
/// [`INLINE_POINTS`].
const INLINE_SIDES: usize = 1 << 17;
/// Points that are looked up before it is asked whether somebody waits for the answer: a millisecond or less. A
/// multiple of the bits in a word.
const POINTS_PER_STEP: usize = 64 << 10;

impl MapService {
    /// Says of each point whether its voxel is occupied, all at one revision.
    ///
    /// # Errors
    /// `InvalidArgument` for a point in no voxel (named by its place), a level that is none, too many points;
    /// `NotFound`; `DeadlineExceeded` when `min_revision` does not come; `FailedPrecondition` when the map has
    /// another uuid.
    pub async fn query_points(&self, map: &MapName, query: PointQuery) -> Result<PointAnswer, ServiceError> {
        let (lookup, points, keep_out) = (query.lookup, query.points.len(), query.keep_out);
        let work = async {
            let map = self.map(map).await?;
            self.limits().check_points(query.points.len())?;
            map.check_level(query.level)?;
            map.check_uuid(query.map_uuid)?;
            if let Some(revision) = query.min_revision {
                map.wait_for_revision(
                    revision,
                    Duration::from_secs_f64(self.limits().min_revision_wait_max_s),
                )
                .await?;
            }
            if query.points.len() <= INLINE_POINTS
                && let Some(answer) = map.try_query(&query)
            {
                return answer;
            }
            let inner = Arc::clone(&self.inner);
            let answer = move |stop: StopSignal<'_>| map.query(&query, &inner.settings.limits, stop);
            self.inner.lanes.for_points(points, keep_out).run(&self.asker, answer).await?
        };
        self.observed("QueryPoints", Some(map), work, |answer| Outcome::Points {
            lookup,
            points: answer.points,
        })
        .await
    }
}

impl HostedMap {
    /// Answers a query. One of many points keeps changes from beginning meanwhile, so that no shorter one queues behind
    /// a change that waits for it.
    pub(crate) fn query(
        &self,
        query: &PointQuery,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<PointAnswer, ServiceError> {
        let points = query.points.as_slice();
        let long_read = (points.len() > POINTS_PER_STEP).then(|| self.map.long_read());
        let view = self.map.view_of(points, &query.map_from_points.unwrap_or_else(Pose::identity));
        let view = if query.keep_out { view.with_keep_outs() } else { view };
        limits
            .check_keep_out_tests(points.len(), view.keep_outs().map_or(0, |keep_outs| keep_outs.sides()))?;
        self.query_in(view, long_read, query, stop)
    }

    /// Answers a query where it need not wait for a lock, and its points are not compared with many keep-outs.
    pub(super) fn try_query(&self, query: &PointQuery) -> Option<Result<PointAnswer, ServiceError>> {
        let map_from_points = query.map_from_points.unwrap_or_else(Pose::identity);
        let points = query.points.as_slice();
        let mut view = self.map.try_view_of(points, &map_from_points)?;
        if query.keep_out {
            view = view.try_with_keep_outs()?;
            let sides = view.keep_outs().map_or(0, |keep_outs| keep_outs.sides());
            if points.len() * sides > INLINE_SIDES {
                return None;
            }
        }
        Some(self.query_in(view, None, query, StopSignal::NEVER))
    }

    fn query_in(
        &self,
        view: MapView<'_>,
        long_read: Option<LongRead<'_>>,
        query: &PointQuery,
        stop: StopSignal<'_>,
    ) -> Result<PointAnswer, ServiceError> {
        query.answer_in(view, long_read, self.uuid, self.map.lattice(), stop)
    }
}

impl PointQuery {
    /// The answer in `view`, which covers the points and has the keep-outs where they count, of the map `map_uuid` on
    /// `lattice`.
    ///
    /// # Errors
    /// `InvalidArgument` for a point in no voxel, named by its place.
    pub fn answer_in(
        &self,
        view: MapView<'_>,
        long_read: Option<LongRead<'_>>,
        map_uuid: Uuid,
        lattice: &Lattice,
        stop: StopSignal<'_>,
    ) -> Result<PointAnswer, ServiceError> {
        let points = self.points.as_slice();
        let map_from_points = self.map_from_points.unwrap_or_else(Pose::identity);
        let quantize = lattice.from_points(&map_from_points);
        let mut occupied = vec![0; points.len().div_ceil(64)];
        let mut all_have_a_voxel = true;
        for (points, words) in points.chunks(POINTS_PER_STEP).zip(occupied.chunks_mut(POINTS_PER_STEP / 64)) {
            check_not_stopped(stop)?;
            all_have_a_voxel &= view.query(points, &quantize, self.level, self.lookup, words);
        }
        let ContentVersion { revision, hash } = view.version();
        let keep_outs = view.keep_outs().filter(|_| self.keep_out).cloned();
        // Changes do not wait until the points are compared with shapes.
        drop((view, long_read));
        if !all_have_a_voxel {
            return Err(point_without_voxel(points, &quantize, lattice));
        }
        if let Some(keep_outs) = keep_outs {
            keep_outs.mark(points, &map_from_points, &mut occupied, stop);
            check_not_stopped(stop)?;
        }
        Ok(PointAnswer {
            points: points.len(),
            points_occupied: occupied.iter().map(|word| word.count_ones() as usize).sum(),
            occupied: bitmap(occupied, points.len()),
            version: MapVersion { revision, map_uuid, content_hash: Some(hash) },
        })
    }
}
