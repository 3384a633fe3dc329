//! Inserting and aligning scans: whose turn it is, on which threads, and for how long.

use std::sync::Arc;

use super::events::PendingEvent;
use super::submit::{Effort, Judged};
use crate::error::{Reason, ServiceError};
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::{Change, JudgedScan, Outcome};
use crate::request::{ScanAnswer, ScanRequest};
use crate::work::{Lanes, TimeLimit};
use mrol_map::map::MapName;
use mrol_map::util::StopSignal;

impl MapService {
    /// Aligns a scan and, where it fits, adds it.
    ///
    /// # Errors
    /// `PermissionDenied` for a robot that is not the caller's, and with `scope_too_small` for a caller that sends
    /// scans alone and asks to carve; `FailedPrecondition` with `guess_required`; `Conflict` for another scan under an
    /// accepted id; `InvalidArgument` for a scan without a usable point or with too many; `ResourceExhausted` while
    /// disk or memory is nearly full; `DeadlineExceeded` with `time_limit` beyond `insertion_time_max`.
    pub async fn insert_scan(&self, map: &MapName, scan: ScanRequest) -> Result<ScanAnswer, ServiceError> {
        let (robot, session, scan_id) = (scan.robot.clone(), scan.session.clone(), scan.scan_id);
        let work = async {
            self.scans.permit(&scan.robot)?;
            let by_settings = self.inner.settings.of_robot(&scan.robot).carve;
            self.scans.permit_carving(&scan.robot, scan.carve, by_settings)?;
            let map = self.map(map).await?;
            let scan = Arc::new(scan);
            self.at_the_leader(
                &map,
                || self.insert_here(&map, &scan),
                |leader, call| {
                    let scan = ScanRequest::clone(&scan);
                    async move { leader.insert_scan(&call, scan).await }
                },
            )
            .await
        };
        self.observed("InsertScan", Some(map), work, |answer| {
            Outcome::Scan(JudgedScan {
                robot,
                session,
                scan_id,
                verdict: answer.verdict,
                refusal: (!answer.accepted).then(|| answer.reason.clone()),
                overlap: answer.overlap(),
                align_time: answer.align_time,
                replayed: answer.replayed,
                recovered: answer.recovered,
                carved: Change::of_carving(answer),
            })
        })
        .await
    }

    async fn insert_here(
        &self,
        map: &Arc<HostedMap>,
        scan: &Arc<ScanRequest>,
    ) -> Result<ScanAnswer, ServiceError> {
        let pending = PendingEvent::begin(map, scan, self.limits().events_per_map_max);
        let judged = self.judge(map, scan).await;
        pending.end(&judged);
        let Judged { answer, .. } = judged?;
        if !answer.accepted {
            self.search_for_robot_of(Arc::clone(map), scan);
        }
        Ok(answer)
    }

    /// Aligns a scan and, where it fits, adds it: from its guess alone where that will do, or else as far as it takes.
    async fn judge(&self, map: &Arc<HostedMap>, scan: &Arc<ScanRequest>) -> Result<Judged, ServiceError> {
        scan.check_insertion()?;
        scan.check_points(self.limits())?;
        if map.is_new(scan) {
            self.inner.budget.check_to_grow()?;
            map.check_room_elsewhere()?;
        }
        let Lanes { mapping, long_mapping, .. } = &self.inner.lanes;
        let requester = self.asker.for_robot(&scan.robot);
        let robot_lock = mapping.once_free(&self.asker, map.robots.lock_robot(&scan.robot)).await?;
        let robot_lock = Arc::new(robot_lock);
        let limit = TimeLimit::new("insertion_time_max", self.limits().insertion_time_max_s);
        let submit = |effort| {
            let (inner, map, scan) = (Arc::clone(&self.inner), Arc::clone(map), Arc::clone(scan));
            let (robot_lock, limit, asker) = (Arc::clone(&robot_lock), limit.clone(), self.asker.clone());
            move |stop: StopSignal<'_>| {
                limit.run(stop, |stop| {
                    let robot_lock = Arc::clone(&robot_lock);
                    map.check_robots_of(&asker, &scan.robot, &inner.settings.limits)?;
                    map.prepare_scan(&scan, robot_lock, effort, &inner.settings, &inner.budget, stop)
                })
            }
        };
        let of = ("InsertScan", map);
        // What keeps failing gives way to what may succeed: it has a lane of its own, with half of the threads, from
        // its first look on.
        if !long_mapping.is_failing(&requester) {
            let at_first = submit(Effort::OneStart);
            if let Some(judged) = self.submit_and_wait(of, (mapping, &requester), None, at_first).await? {
                return Ok(judged);
            }
        }
        // A robot of which a scan takes long now and then waits for turns of the others.
        let lane = if long_mapping.is_failing(&requester) { long_mapping } else { mapping };
        let thread = limit.wait(lane.thread(&requester)).await??;
        let judged = self.submit_and_wait(of, (lane, &requester), Some(thread), submit(Effort::Whole)).await;
        long_mapping.note(
            &requester,
            judged.as_ref().is_ok_and(|judged| judged.as_ref().is_some_and(|judged| judged.answer.accepted)),
        );
        judged?.ok_or_else(|| ServiceError::new(Reason::JobPanicked, "the scan was not judged"))
    }

    /// Aligns a scan and says what [`MapService::insert_scan`] would; changes nothing.
    ///
    /// # Errors
    /// As for an insertion; the limit is `alignment_time_max`.
    pub async fn align_scan(&self, map: &MapName, scan: ScanRequest) -> Result<ScanAnswer, ServiceError> {
        let work = async {
            self.scans.permit(&scan.robot)?;
            let map = self.map(map).await?;
            scan.check_alignment()?;
            scan.check_points(self.limits())?;
            let inner = Arc::clone(&self.inner);
            let requester = self.asker.for_robot(&scan.robot);
            let limit = TimeLimit::new("alignment_time_max", self.limits().alignment_time_max_s);
            let align = move |stop: StopSignal<'_>| {
                limit.run(stop, |stop| map.align_scan(&scan, &inner.settings, stop))
            };
            self.inner.lanes.alignment.run(requester, align).await?
        };
        self.observed("AlignScan", Some(map), work, |_| Outcome::Read).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::Limits;
    use crate::request::PointCloud;
    use crate::settings::ServiceSettings;
    use crate::work::Asker;
    use mrol_map::geometry::{Point, Pose};
    use mrol_map::map::{MapSettings, RobotName};
    use mrol_map::mapping::Guess;
    use mrol_store::OpeningProgress;

    #[tokio::test]
    async fn one_caller_brings_in_its_share_of_robots_and_others_have_room() {
        let limits = Limits { robots_per_caller_max: 2, ..Limits::default() };
        let settings = ServiceSettings { limits, ..ServiceSettings::default() };
        let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
        let map = MapName::new("a").unwrap();
        service.create_map(map.clone(), MapSettings::new(0.1, 1)).await.unwrap();
        let send = async |asker: &str, robot: &str| {
            let points = PointCloud::from(vec![Point::new(1.0, 2.0, 0.5)]);
            let mut scan = ScanRequest::new(RobotName::new(robot).unwrap(), points);
            (scan.guess, scan.at_guess) = (Guess::Pose(Pose::identity()), true);
            let caller = service.clone().asked_by(Asker::with_key(asker));
            caller.insert_scan(&map, scan).await.map(|answer| answer.accepted).map_err(|error| error.reason)
        };
        for (asker, robot, told) in [
            ("one", "r1", Ok(true)),
            ("one", "r2", Ok(true)),
            ("one", "r3", Err(Reason::TooManyRobots)),
            ("one", "r1", Ok(true)),
            ("other", "r3", Ok(true)),
            // It has scans there by now, whoever sent them.
            ("one", "r3", Ok(true)),
        ] {
            assert_eq!(send(asker, robot).await, told, "{robot} of {asker}");
        }
    }

    #[tokio::test]
    async fn a_long_scan_takes_a_turn_in_mapping_until_such_scans_keep_failing() {
        let service = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        let map = MapName::new("a").unwrap();
        service.create_map(map.clone(), MapSettings::new(0.1, 3)).await.unwrap();
        let wall =
            |x: f32| (0..3000).map(move |n| Point::new(x, (n % 60) as f32 * 0.05, (n / 60) as f32 * 0.05));
        let send = async |robot: &str, points: Vec<Point>, at_guess: bool| {
            let mut scan = ScanRequest::new(RobotName::new(robot).unwrap(), points.into());
            (scan.guess, scan.at_guess) = (Guess::Pose(Pose::identity()), at_guess);
            service.insert_scan(&map, scan).await.unwrap().accepted
        };
        assert!(send("honest", wall(2.0).collect(), true).await);
        let begun = |name: &str| service.lanes().into_iter().find(|lane| lane.name == name).unwrap().begun;
        // What fits nowhere near needs more starts, after a first look.
        for (failures, apart) in [(0, 0), (1, 0), (2, 0), (3, 1), (4, 2)] {
            let before = begun("mapping");
            assert!(!send("garbage", wall(-7.0).collect(), false).await, "after {failures}");
            let in_mapping = if apart > 0 { 0 } else { 2 };
            assert_eq!((begun("mapping") - before, begun("long_mapping")), (in_mapping, apart));
        }
    }
}
