//! How often the service's long operations look at their stop signal.

use std::cell::Cell;
use std::time::Duration;

use uuid::Uuid;

use crate::commit::{CommitThreads, Step};
use crate::error::{Reason, ServiceError};
use crate::lifecycle::from_file;
use crate::limits::{Limits, Marks};
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::request::{
    BlockForm, BlockRequest, ListingRequest, PointCloud, PointQuery, ScanRequest, Undo, UndoTarget,
};
use crate::resources::ResourceBudget;
use crate::scan::LocalizationRequest;
use crate::settings::ServiceSettings;
use crate::work::TimeLimit;
use mrol_map::align::localize::LocalizationQuery;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{
    Lookup, MapContents, MapName, MapSettings, MappedScan, MultiResolutionMap, Region, RobotName, SHARDS,
    ScanRecord,
};
use mrol_map::mapping::Guess;
use mrol_map::util::{GiveWay, StopSignal};
use mrol_map::voxel::VoxelKey;
use mrol_store::{OpeningProgress, StoreSettings};

fn wall(count: usize) -> Vec<Point> {
    (0..count).map(|i| Point::new((i % 97) as f32 * 0.05, 2.0, (i / 97 % 89) as f32 * 0.05)).collect()
}

fn robot() -> RobotName {
    RobotName::new("r").unwrap()
}

fn hosted() -> HostedMap {
    let map = MultiResolutionMap::new(MapSettings::new(0.05, 4)).unwrap();
    let pose = MappedScan::new(robot(), Pose::identity());
    map.committer().insert_scan(ScanRecord::of_points(pose, &wall(10_000), map.lattice()));
    {
        let name = MapName::new("a").unwrap();
        let threads = CommitThreads::start().unwrap();
        HostedMap::new(&threads, name, Uuid::nil(), map, None, &StoreSettings::default())
    }
}

/// A map of a block of voxels every eight, so many squared, and the bytes that it takes.
fn sheet(side: i32) -> (HostedMap, u64) {
    let square = (0..side).flat_map(|x| (0..side).map(move |y| [x * 8, y * 8, 0]));
    let contents = MapContents::at(1, square.filter_map(VoxelKey::new).collect());
    let map = MultiResolutionMap::restore(MapSettings::new(0.05, 4), contents).unwrap();
    let bytes = map.memory_bytes() as u64;
    let name = MapName::new("sheet").unwrap();
    let threads = CommitThreads::start().unwrap();
    (HostedMap::new(&threads, name, Uuid::nil(), map, None, &StoreSettings::default()), bytes)
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
            keep_out: false,
        };
        map.query(&query, &Limits::default(), StopSignal::when(&count_look)).unwrap();
        assert!(count / looks.get() <= 64 << 10, "{count} points, {} looks", looks.get());
    }
}

#[test]
fn a_listing_looks_at_the_signal_before_each_shard() {
    let map = hosted();
    for region in [None, Some(Region::cuboid([-100.0; 3], [100.0; 3]).unwrap())] {
        let looks = Cell::new(0);
        let count_look = || looks.replace(looks.get() + 1) == usize::MAX;
        let listing =
            map.list(&ListingRequest::of(0, region), usize::MAX, StopSignal::when(&count_look)).unwrap();
        assert!(listing.keys.len() > 5000 && looks.get() >= SHARDS, "{} looks", looks.get());
        let gone = || true;
        let gone = map.list(&ListingRequest::of(0, region), usize::MAX, StopSignal::when(&gone)).unwrap_err();
        assert_eq!(gone.reason, Reason::CallerGone);
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
        assert_eq!(late.reason, Reason::TimeLimit);
        let gone = || true;
        let gone = map.align_scan(&request, &settings, StopSignal::when(&gone)).unwrap_err();
        assert_eq!(gone.reason, Reason::CallerGone);
    }
}

#[test]
fn a_search_whose_caller_has_gone_is_no_answer_and_one_whose_time_is_up_is() {
    let (map, settings) = (hosted(), ServiceSettings::default());
    let budget = ResourceBudget::new(None, Marks::default());
    let request = LocalizationRequest {
        points: PointCloud::from(wall(10_000)),
        query: LocalizationQuery { candidates: 1, ..LocalizationQuery::default() },
        time_limit: Some(Duration::ZERO),
    };
    let answer = map.localize(&request, &settings, &budget, StopSignal::NEVER).unwrap();
    assert!(answer.cut_short && !answer.accepted() && answer.candidates.is_empty());
    let gone = || true;
    let gone = map.localize(&request, &settings, &budget, StopSignal::when(&gone)).unwrap_err();
    assert_eq!(gone.reason, Reason::CallerGone);
}

#[test]
fn a_map_file_is_made_and_read_and_a_map_described_with_looks_in_proportion_to_its_size() {
    let (budget, limits) = (ResourceBudget::new(None, Marks::default()), ServiceSettings::default().limits);
    for side in [40, 160, 320] {
        let (map, bytes) = sheet(side);
        let looks = Cell::new(0);
        let count_look = || looks.replace(looks.get() + 1) == u64::MAX;
        let stop = StopSignal::when(&count_look);
        let file = map.to_file(&budget, &limits, stop).unwrap();
        let at_file = looks.replace(0);
        assert!(bytes / at_file <= 4 << 20, "{bytes} bytes of map, {at_file} looks");
        assert!(from_file(&file.bytes, &limits, &budget, stop).is_ok());
        let at_map = looks.replace(0);
        assert!(bytes / at_map <= 4 << 20, "{bytes} bytes of map, {at_map} looks");
        map.describe(100, stop).unwrap();
        assert!(bytes / looks.get() <= 4 << 20, "{bytes} bytes of map, {} looks", looks.get());
    }
}

#[test]
fn a_map_file_or_a_description_that_nobody_waits_for_is_given_up_at_the_next_look() {
    let (budget, limits) = (ResourceBudget::new(None, Marks::default()), ServiceSettings::default().limits);
    let (map, _) = sheet(100);
    let file = map.to_file(&budget, &limits, StopSignal::NEVER).unwrap().bytes;
    for looks_max in (0..20).chain([50, 100]) {
        let looks = Cell::new(0u64);
        let is_gone = || looks.replace(looks.get() + 1) >= looks_max;
        let stop = StopSignal::when(&is_gone);
        let caller_gone = |error: Option<ServiceError>| {
            let taken = looks.replace(0);
            assert!(taken <= looks_max + 300, "{taken} looks after {looks_max}");
            assert_eq!(error.map(|error| error.reason), (taken > looks_max).then_some(Reason::CallerGone));
        };
        caller_gone(map.to_file(&budget, &limits, stop).err());
        caller_gone(from_file(&file, &limits, &budget, stop).err());
        caller_gone(map.describe(100, stop).err());
    }
}

#[test]
fn a_deletion_finds_what_it_means_with_looks_in_proportion_to_the_map() {
    let everywhere = Region::cuboid([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]).unwrap();
    for side in [40, 160, 320] {
        let (map, _) = sheet(side);
        let looks = Cell::new(0);
        let count_look = || looks.replace(looks.get() + 1) == usize::MAX;
        let stop = StopSignal::when(&count_look);
        let blocks = map.map.view().finest_in_until(&everywhere, 0, stop).blocks().len();
        assert_eq!(blocks, (side * side) as usize);
        assert!(blocks / looks.get() <= 16 << 10, "{blocks} blocks, {} looks", looks.get());
        let gone = || true;
        let listed = map.list(&ListingRequest::of(0, Some(everywhere)), usize::MAX, StopSignal::when(&gone));
        assert_eq!(listed.unwrap_err().reason, Reason::CallerGone);
    }
}

#[test]
fn a_block_and_a_count_are_made_with_looks_in_proportion_to_the_map_and_given_up_at_the_next_one() {
    let everywhere = Region::cuboid([-1e3; 3], [1e3; 3]).unwrap();
    let (limits, counted) = (
        Limits { block_bytes_max: 1 << 30, message_bytes_max: usize::MAX, ..Limits::default() },
        ListingRequest { count_only: true, ..ListingRequest::of(0, Some(everywhere)) },
    );
    let request = BlockRequest { level: 0, form: BlockForm::Sparse { region: None } };
    for side in [40, 160, 320] {
        let (map, _) = sheet(side);
        let blocks = (side * side) as usize;
        let block =
            |stop: StopSignal<'_>| request.answer_in(&map.map, map.uuid, &limits, |_| Ok(()), stop).map(drop);
        let count = |stop: StopSignal<'_>| map.count(&counted, usize::MAX, stop).map(drop);
        for work in [&block as &dyn Fn(StopSignal<'_>) -> Result<(), ServiceError>, &count] {
            let looks = Cell::new(0);
            let count_look = || looks.replace(looks.get() + 1) == usize::MAX;
            work(StopSignal::when(&count_look)).unwrap();
            assert!(blocks / looks.get() <= 16 << 10, "{blocks} blocks, {} looks", looks.get());
            let gone = || true;
            assert_eq!(work(StopSignal::when(&gone)).unwrap_err().reason, Reason::CallerGone);
        }
    }
}

/// Counts how often work would let other work go first.
#[derive(Default)]
struct Counted(Cell<usize>);

impl GiveWay for Counted {
    fn is_due(&self) -> bool {
        true
    }

    fn give_way(&self) {
        self.0.set(self.0.get() + 1);
    }

    fn paused_for(&self) -> Duration {
        Duration::ZERO
    }
}

#[tokio::test]
async fn an_undo_gives_way_before_each_change_that_it_reads() {
    const SCANS: usize = 20;
    let folder = tempfile::tempdir().unwrap();
    let settings = ServiceSettings { data_dir: Some(folder.path().into()), ..ServiceSettings::default() };
    let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
    let name = MapName::new("a").unwrap();
    service.create_map(name.clone(), MapSettings::new(0.1, 1)).await.unwrap();
    for n in 0..SCANS {
        let points = vec![Point::new(n as f32 + 0.05, 0.05, 0.05)].into();
        let (guess, at_guess) = (Guess::Pose(Pose::identity()), true);
        let scan = ScanRequest { guess, at_guess, ..ScanRequest::new(robot(), points) };
        service.insert_scan(&name, scan).await.unwrap();
    }
    let map = service.map(&name).await.unwrap();
    let undo = Undo { target: UndoTarget::RobotSince { robot: robot(), revision: 0 }, request_id: None };
    let (budget, turns) = (ResourceBudget::new(None, Marks::default()), Counted::default());
    let limit = TimeLimit::new("undo_time_max", 3600.0);
    let stop = StopSignal::NEVER.giving_way_by(&turns);
    assert!(matches!(map.prepare_undo(&undo, None, true, &budget, &limit, stop), Ok(Step::Ready(..))));
    // Those that are undone, and all since the snapshot before them.
    assert!(turns.0.get() >= 2 * SCANS, "{}", turns.0.get());
}
