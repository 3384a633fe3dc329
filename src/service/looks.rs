//! How often the service's long operations look at their stop signal.

use std::cell::Cell;

use uuid::Uuid;

use super::committing::CommitThread;
use super::hosted_map::HostedMap;
use super::room::Room;
use super::{ErrorCode, LocalizationRequest, Marks, PointCloud, PointQuery, ScanRequest, ServiceSettings};
use crate::align::localize::LocalizationQuery;
use crate::geometry::{Point, Pose};
use crate::map::{Lookup, MapName, MapSettings, MultiResolutionMap, RobotName, ScanRecord, TrajectoryPose};
use crate::mapping::Guess;
use crate::store::StoreSettings;
use crate::util::StopSignal;

fn wall(count: usize) -> Vec<Point> {
    (0..count).map(|i| Point::new((i % 97) as f32 * 0.05, 2.0, (i / 97 % 89) as f32 * 0.05)).collect()
}

fn robot() -> RobotName {
    RobotName::new("r").unwrap()
}

fn hosted() -> HostedMap {
    let map = MultiResolutionMap::new(MapSettings::new(0.05, 4)).unwrap();
    let pose = TrajectoryPose::new(robot(), Pose::identity());
    map.committer().insert_scan(ScanRecord::of_points(pose, &wall(10_000), map.lattice()));
    {
        let name = MapName::new("a").unwrap();
        let thread = CommitThread::start(&name).unwrap();
        HostedMap::new(thread, name, Uuid::nil(), map, None, &StoreSettings::default())
    }
}

#[test]
fn a_query_looks_at_the_signal_in_proportion_to_its_points() {
    let map = hosted();
    for count in [1_000, 100_000, 2_000_000] {
        let looks = Cell::new(0);
        let count_look = || looks.replace(looks.get() + 1) == usize::MAX;
        let query = PointQuery {
            points: wall(count).into(),
            map_from_points: None,
            level: 0,
            lookup: Lookup::Exact,
            min_revision: None,
            map_uuid: None,
        };
        map.query(&query, StopSignal::when(&count_look)).unwrap();
        assert!(count / looks.get() <= 64 << 10, "{count} points, {} looks", looks.get());
    }
}

#[test]
fn an_alignment_whose_time_is_up_says_so_and_one_whose_caller_has_gone_is_not_told() {
    let (map, settings) = (hosted(), ServiceSettings::default());
    let request = ScanRequest {
        guess: Guess::Pose(Pose::identity()),
        ..ScanRequest::new(robot(), wall(300_000).into())
    };
    let now = StopSignal::NEVER.by(std::time::Instant::now());
    for at_guess in [false, true] {
        let request = ScanRequest { at_guess, ..request.clone() };
        let late = map.align_scan(&request, &settings, now).unwrap_err();
        assert_eq!((late.code, late.reason), (ErrorCode::DeadlineExceeded, "time_limit"));
        let gone = || true;
        let gone = map.align_scan(&request, &settings, StopSignal::when(&gone)).unwrap_err();
        assert_eq!(gone.reason, "caller_gone");
    }
}

#[test]
fn a_search_whose_caller_has_gone_is_no_answer_and_one_whose_time_is_up_is() {
    let (map, settings) = (hosted(), ServiceSettings::default());
    let room = Room::new(None, Marks::default());
    let request = LocalizationRequest {
        points: PointCloud::from(wall(10_000)),
        query: LocalizationQuery { candidates: 1, ..LocalizationQuery::default() },
        time_limit: Some(std::time::Duration::ZERO),
    };
    let answer = map.localize(&request, &settings, &room, StopSignal::NEVER).unwrap();
    assert!(answer.cut_short && !answer.accepted() && answer.candidates.is_empty());
    let gone = || true;
    let gone = map.localize(&request, &settings, &room, StopSignal::when(&gone)).unwrap_err();
    assert_eq!(gone.reason, "caller_gone");
}
