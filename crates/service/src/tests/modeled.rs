//! The steps of the service that lock, under a model checker: guess, describe, save, delete and commit, of a map that
//! is kept on a simulated disk. In every order of steps that it tries nobody waits for ever, and what was acknowledged
//! is there when the folder is opened again.
//!
//!     cargo test -p mrol-service --features shuttle --lib modeled

use std::path::Path;
use std::sync::Arc;

use shuttle::future::block_on;
use shuttle::scheduler::{PctScheduler, RandomScheduler};
use shuttle::{Config, Runner, thread};
use uuid::Uuid;

use crate::commit::{CommitThreads, Step};
use crate::error::ServiceError;
use crate::limits::Marks;
use crate::maps::{HostedMap, Saving};
use crate::request::{Deletion, DeletionTarget, ScanRequest};
use crate::resources::ResourceBudget;
use crate::scan::Effort;
use crate::settings::ServiceSettings;
use crate::work::{Asker, Requester};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MapName, MapSettings, MultiResolutionMap, Region, RobotName};
use mrol_map::mapping::Guess;
use mrol_map::util::StopSignal;
use mrol_store::{DataDir, OpeningProgress, Snapshot, StoreSettings};

#[path = "../../../../tests/support/simulated_disk.rs"]
#[expect(dead_code, reason = "nothing fails here")]
mod simulated;

/// Stack of each modeled thread: what a change plans and a snapshot encodes takes more than the checker gives by
/// itself.
const STACK_BYTES: usize = 2 << 20;

fn name() -> MapName {
    MapName::new("office").unwrap()
}

fn data_dir(disk: &simulated::SimulatedDisk) -> DataDir {
    DataDir::on(Arc::new(disk.clone()), Path::new("data"), StoreSettings::default()).unwrap()
}

/// Three scans of a robot, at their guesses; the last one guesses by constant velocity. The newest revision that it was
/// told.
fn insert_three(map: &Arc<HostedMap>, budget: &Arc<ResourceBudget>, robot: &str, x: f32) -> u64 {
    let mut newest = 0;
    for (scan_id, guess) in (0..).zip([Guess::Pose(Pose::identity()), Guess::Last, Guess::ConstantVelocity]) {
        let points = vec![Point::new(x, scan_id as f32, 0.5)].into();
        let request = ScanRequest {
            scan_id: Some(scan_id),
            guess,
            at_guess: true,
            ..ScanRequest::new(RobotName::new(robot).unwrap(), points)
        };
        let robot_lock = Arc::new(block_on(map.robots.lock_robot(&request.robot)));
        let settings = ServiceSettings::default();
        let step =
            map.prepare_scan(&request, robot_lock, Effort::Whole, &settings, budget, StopSignal::NEVER);
        newest = outcome(map, step).unwrap().expect("a scan at its guess").answer.version.revision;
    }
    newest
}

/// What becomes of a change, when it is visible.
fn outcome<A>(map: &HostedMap, step: Result<Step<A>, ServiceError>) -> Result<A, ServiceError> {
    let requester = Requester::from(&Asker::default());
    match step? {
        Step::Answered(answer) => Ok(answer),
        Step::Ready(submission, answer) => match block_on(map.commit_queue.submit(&requester, submission)?) {
            Ok(Ok(committed)) => Ok(answer(committed)),
            Ok(Err(_)) | Err(_) => Err(ServiceError::overloaded("refused")),
        },
    }
}

fn delete_everything(map: &Arc<HostedMap>, budget: &Arc<ResourceBudget>) -> u64 {
    let region = Region::ball([0.0; 3], 100.0).unwrap();
    let deletion = Deletion { target: DeletionTarget::Region(region), level: 0, request_id: None };
    outcome(map, map.prepare_deletion(&Arc::new(deletion), None, budget, StopSignal::NEVER))
        .unwrap()
        .version
        .revision
}

fn crowd() {
    let disk = simulated::SimulatedDisk::default();
    let (uuid, core) = (Uuid::from_u128(7), MultiResolutionMap::new(MapSettings::new(1.0, 4)).unwrap());
    let folder = data_dir(&disk).create(&name(), &Snapshot::of(&core, uuid)).unwrap();
    let threads = CommitThreads::start().unwrap();
    let map = HostedMap::new(&threads, name(), uuid, core, Some(folder), &StoreSettings::default());
    let (map, budget) = (Arc::new(map), Arc::new(ResourceBudget::new(None, Marks::default())));
    let spawn = |work: fn(&Arc<HostedMap>, &Arc<ResourceBudget>) -> u64| {
        let (map, budget) = (Arc::clone(&map), Arc::clone(&budget));
        thread::spawn(move || work(&map, &budget))
    };
    let threads = [
        spawn(|map, budget| insert_three(map, budget, "one", 0.5)),
        spawn(|map, budget| insert_three(map, budget, "two", 70.5)),
        spawn(delete_everything),
        spawn(|map, budget| {
            let revision = map.describe(8, StopSignal::NEVER).unwrap().version.revision;
            map.save(Saving::Changed, budget).unwrap();
            map.describe(8, StopSignal::NEVER).unwrap().version.revision.max(revision)
        }),
    ];
    let newest = threads.into_iter().map(|thread| thread.join().unwrap()).max().unwrap_or_default();
    let contents = map.map.contents();
    assert!(contents.revision >= 6, "six scans were acknowledged");
    assert!(contents.revision >= newest, "{} after {newest} was acknowledged", contents.revision);
    drop(map);
    let opened = data_dir(&disk).map(&name(), &OpeningProgress::default()).unwrap();
    assert!(opened.map.contents() == contents, "what was acknowledged is not there");
}

#[test]
fn nobody_waits_for_ever_and_nothing_acknowledged_is_lost() {
    let schedules = std::env::var("MROL_SCHEDULES").map_or(200, |text| text.parse().unwrap());
    let mut config = Config::new();
    config.stack_size = STACK_BYTES;
    Runner::new(RandomScheduler::new(schedules), config.clone()).run(crowd);
    Runner::new(PctScheduler::new(3, schedules), config).run(crowd);
}
