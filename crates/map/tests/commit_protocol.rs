//! The shards' locks and the commit protocol under a model checker: in every order of steps that it tries, what each
//! reader saw is what the changes give one after another, up to the revision that the reader was told.
//!
//!     cargo test -p mrol-map --features shuttle --test commit_protocol
#![expect(clippy::unwrap_used, reason = "a test fails where it must")]

use std::sync::Arc;

use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{
    Change, Committed, DeletionRecord, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOutShape,
    Lookup, MapContents, MapSettings, MappedScan, MultiResolutionMap, Region, Request, RequestId, RobotName,
    ScanRecord,
};
use mrol_map::voxel::VoxelSet;
use shuttle::thread;

const RESOLUTION_M: f64 = 1.0;
/// Regions are that wide, and the three first along x lie in three shards.
const REGION_M: f32 = 64.0;

/// Orders that are tried, by each scheduler: `MROL_SCHEDULES`.
fn schedules() -> usize {
    std::env::var("MROL_SCHEDULES").map_or(500, |text| text.parse().unwrap())
}

/// Some points in each of `regions`; 120 of them are more than a shard has room for at first.
fn points(regions: &[u8], each: usize) -> Vec<Point> {
    let place = |region: u8, i: usize| {
        Point::new(f32::from(region) * REGION_M + (i % 40) as f32 + 0.5, (i / 40) as f32 * 8.0 + 0.5, 0.5)
    };
    regions.iter().flat_map(|&region| (0..each).map(move |i| place(region, i))).collect()
}

fn new_map() -> MultiResolutionMap {
    MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 4)).unwrap()
}

fn insertion(map: &MultiResolutionMap, robot: &str, regions: &[u8], each: usize) -> Change {
    let pose = MappedScan::new(RobotName::new(robot).unwrap(), Pose::identity());
    Change::Insertion(ScanRecord::of_points(pose, &points(regions, each), map.lattice()))
}

fn deletion(map: &MultiResolutionMap, regions: &[u8], each: usize) -> Change {
    let (voxels, _) = VoxelSet::of_points(&points(regions, each), &map.lattice().from_map());
    Change::Deletion(DeletionRecord { voxels, request: None })
}

/// A keep-out that is put, or removed.
fn keep_out(name: &str, is_there: bool) -> Change {
    let shape = KeepOutShape::of_region(Region::ball([0.0; 3], 1.0).unwrap()).unwrap();
    let act = match is_there {
        true => KeepOutAct::Put { shape, made_by: None, expires_at_ns: None },
        false => KeepOutAct::Removed { by: None },
    };
    let id = RequestId::new(&format!("{name}-{is_there}")).unwrap();
    let change = KeepOutChange { name: KeepOutName::new(name).unwrap(), act };
    Change::KeepOut(KeepOutRecord { change, request: Some(Request { id, digest: 1, caller: None }) })
}

/// What a reader was told: a revision, its keep-outs by the revisions that they made, and what is occupied of three
/// points of each of two regions, exactly and by the filter, finest and at level 3.
#[derive(Debug, PartialEq)]
struct Answer {
    revision: u64,
    keep_outs: Vec<u64>,
    occupied: [u64; 4],
}

fn ask(map: &MultiResolutionMap) -> Answer {
    let (points, quantize) = (points(&[0, 2], 3), map.lattice().from_map());
    let view = map.view_of(&points, &Pose::identity()).with_keep_outs();
    let ways = [(0, Lookup::Exact), (0, Lookup::Bloom), (3, Lookup::Exact), (3, Lookup::Bloom)];
    let occupied = ways.map(|(level, lookup)| {
        let mut bits = [0];
        view.query(&points, &quantize, level, lookup, &mut bits);
        bits[0]
    });
    let keep_outs = view.keep_outs().unwrap().iter().map(|it| it.made_revision).collect();
    Answer { revision: view.revision(), keep_outs, occupied }
}

/// Two writers of voxels and one of keep-outs, one who asks twice, and one who takes the picture of the whole map.
fn crowd() {
    let map = Arc::new(new_map());
    let write = |changes: Vec<Change>| {
        let map = Arc::clone(&map);
        thread::spawn(move || {
            let commit = |change: Change| (map.committer().apply(&change), change);
            changes.into_iter().map(commit).collect::<Vec<(Committed, Change)>>()
        })
    };
    let writers = [
        write(vec![insertion(&map, "one", &[0, 1, 2], 3), deletion(&map, &[0, 2], 2)]),
        write(vec![insertion(&map, "two", &[0, 2], 120), deletion(&map, &[1, 2], 120)]),
        write(vec![keep_out("a", true), keep_out("b", true), keep_out("a", false)]),
    ];
    let asking = thread::spawn({
        let map = Arc::clone(&map);
        move || [ask(&map), ask(&map)]
    });
    let looking = thread::spawn({
        let map = Arc::clone(&map);
        move || map.contents()
    });
    let mut changes: Vec<_> = writers.into_iter().flat_map(|writer| writer.join().unwrap()).collect();
    let (answers, seen) = (asking.join().unwrap(), looking.join().unwrap());
    let is_made = |(committed, change): &(Committed, Change)| {
        committed.added + committed.removed > 0 || matches!(change, Change::KeepOut(_))
    };
    changes.retain(is_made);
    changes.sort_unstable_by_key(|(committed, _)| committed.revision);
    check(&changes, &answers, &[seen, map.contents()]);
}

/// Makes the changes one after another, and compares what was seen with what is there at its revision.
fn check(changes: &[(Committed, Change)], answers: &[Answer], pictures: &[MapContents]) {
    let serial = new_map();
    for revision in 0..=changes.len() as u64 {
        if let Some((committed, change)) = revision.checked_sub(1).map(|i| &changes[i as usize]) {
            assert_eq!(serial.committer().apply(change), *committed);
        }
        for answer in answers.iter().filter(|answer| answer.revision == revision) {
            assert_eq!(*answer, ask(&serial));
        }
        for picture in pictures.iter().filter(|picture| picture.revision == revision) {
            assert_eq!(*picture, serial.contents());
        }
    }
    let last = changes.len() as u64;
    assert!(answers.iter().all(|answer| answer.revision <= last));
    assert!(answers[0].revision <= answers[1].revision && pictures[1].revision == last);
    for (level, view) in (0..4).map(|level| (level, serial.view())) {
        let lists_hold = view.lists(level).all(|list| {
            list.filter().is_some_and(|filter| filter.is_recount_of(list.iter().map(|voxel| voxel.to_bits())))
        });
        assert!(lists_hold, "level {level}");
    }
}

#[test]
fn readers_see_one_revision_whatever_the_order_of_steps() {
    shuttle::check_random(crowd, schedules());
}

#[test]
fn readers_see_one_revision_where_few_threads_are_held_back_for_long() {
    shuttle::check_pct(crowd, schedules(), 3);
}
