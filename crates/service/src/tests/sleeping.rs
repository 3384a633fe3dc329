//! Maps that sleep: answers are right, whatever falls asleep and wakes meanwhile.

use std::path::Path;
use std::time::Duration;

use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{KeepOutName, KeepOutShape, MapName, MapSettings, Region, RobotName};
use mrol_map::mapping::Guess;
use mrol_store::OpeningProgress;

use crate::error::Reason;
use crate::map_service::MapService;
use crate::request::{EventsQuery, MapsAwake, PutKeepOut, ScanRequest, WatchRequest};
use crate::settings::ServiceSettings;

fn settings(data: &Path) -> ServiceSettings {
    let sleep_after = Some(Duration::ZERO);
    ServiceSettings { data_dir: Some(data.to_owned()), sleep_after, ..ServiceSettings::default() }
}

fn service(data: &Path) -> MapService {
    MapService::open(settings(data), &OpeningProgress::default()).unwrap()
}

/// The same maps once the service before has let go of the folder.
async fn service_again(data: &Path) -> MapService {
    loop {
        match MapService::open(settings(data), &OpeningProgress::default()) {
            Ok(service) => return service,
            Err(error) => {
                assert_eq!(error.reason, Reason::NotStored, "{error}");
                tokio::task::yield_now().await;
            }
        }
    }
}

fn name(number: usize) -> MapName {
    MapName::new(&format!("tile-{number}")).unwrap()
}

async fn create(service: &MapService, number: usize) {
    service.create_map(name(number), MapSettings::new(0.1, 4)).await.unwrap();
}

/// Inserts the scan of that id, which is one point; its revision.
async fn insert(service: &MapService, map: usize, scan_id: u64) -> u64 {
    let scan = ScanRequest {
        scan_id: Some(scan_id),
        guess: Guess::Pose(Pose::identity()),
        at_guess: true,
        ..ScanRequest::new(RobotName::new("r").unwrap(), vec![Point::new(scan_id as f32, 0.05, 0.05)].into())
    };
    service.insert_scan(&name(map), scan).await.unwrap().version.revision
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_that_nobody_uses_sleeps_is_listed_as_it_was_and_wakes_for_a_request() {
    let data = tempfile::tempdir().unwrap();
    let service = service(data.path());
    create(&service, 0).await;
    for scan_id in 0..3 {
        insert(&service, 0, scan_id).await;
    }
    let awake = service.map_info(&name(0)).await.unwrap();
    assert!(!awake.is_asleep && awake.sightings.len() == 1);
    let events = service.list_events(&name(0), EventsQuery::default()).await.unwrap().len();
    assert_eq!(events, 3);

    assert_eq!(service.put_unused_to_sleep().await, 1);
    for _ in 0..2 {
        // Nobody is woken by the list, by names or by figures.
        let listed = service.list_maps().await.unwrap();
        assert_eq!(listed.len(), 1);
        assert!(listed[0].is_asleep);
        assert_eq!((listed[0].version, listed[0].scans), (awake.version, 3));
        assert_eq!(listed[0].levels[0].voxels, 3);
        assert_eq!(service.map_names(), [name(0)]);
        assert_eq!(service.maps_awake(), MapsAwake { awake: 0, asleep: 1, wakes: 0 });
    }
    let woken = service.map_info(&name(0)).await.unwrap();
    assert_eq!((woken.version, woken.levels[0].voxels), (awake.version, 3));
    assert_eq!(woken.sightings, awake.sightings, "what is known since the start outlives sleep");
    assert_eq!(service.list_events(&name(0), EventsQuery::default()).await.unwrap().len(), events);
    assert_eq!(service.maps_awake(), MapsAwake { awake: 1, asleep: 0, wakes: 1 });
    // The same scan again is answered again, and the next one follows.
    assert_eq!((insert(&service, 0, 1).await, insert(&service, 0, 3).await), (2, 4));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_that_is_watched_or_is_to_change_by_itself_stays_awake() {
    let data = tempfile::tempdir().unwrap();
    let service = service(data.path());
    for number in 0..3 {
        create(&service, number).await;
    }
    let watch = service.watch(&name(0), WatchRequest::default()).await.unwrap();
    let shape = KeepOutShape::of_region(Region::ball([0.0; 3], 1.0).unwrap()).unwrap();
    let keep_out = PutKeepOut {
        name: KeepOutName::new("wet").unwrap(),
        shape,
        expires_at_ns: Some(i64::MAX - 1),
        request_id: None,
    };
    service.put_keep_out(&name(1), keep_out).await.unwrap();
    assert_eq!(service.put_unused_to_sleep().await, 1);
    let asleep = |maps: Vec<crate::MapInfo>| maps.iter().map(|map| map.is_asleep).collect::<Vec<_>>();
    assert_eq!(asleep(service.list_maps().await.unwrap()), [false, false, true]);
    drop(watch);
    // A caller that went away lets go of the map after a while.
    while service.put_unused_to_sleep().await == 0 {
        tokio::task::yield_now().await;
    }
    assert_eq!(asleep(service.list_maps().await.unwrap()), [true, false, true]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_that_sleeps_has_its_name_and_can_be_made_again_replaced_renamed_and_deleted() {
    let data = tempfile::tempdir().unwrap();
    let service = service(data.path());
    for number in 0..2 {
        create(&service, number).await;
        insert(&service, number, 0).await;
    }
    let file = service.snapshot_map(&name(0)).await.unwrap().bytes;
    assert_eq!(service.put_unused_to_sleep().await, 2);
    let (info, created) = service.create_map(name(0), MapSettings::new(0.1, 4)).await.unwrap();
    assert!(!created && info.version.revision == 1);
    assert_eq!(service.put_unused_to_sleep().await, 1);
    let taken = service.restore_map(name(0), file.clone(), false).await.unwrap_err();
    assert_eq!(taken.reason, Reason::MapExists);
    service.restore_map(name(0), file, true).await.unwrap();
    service.put_unused_to_sleep().await;
    service.rename_map(&name(1), &name(2)).await.unwrap();
    service.put_unused_to_sleep().await;
    assert_eq!(service.map_info(&name(2)).await.unwrap().version.revision, 1);
    assert_eq!(insert(&service, 2, 1).await, 2);
    service.put_unused_to_sleep().await;
    service.rename_map(&name(2), &name(1)).await.unwrap();
    service.delete_map(&name(1)).await.unwrap();
    let names: Vec<String> = service.map_names().iter().map(ToString::to_string).collect();
    assert_eq!(names, ["tile-0", "tile-0-replaced-1"]);
    assert_eq!(service.map_info(&name(1)).await.unwrap_err().reason, Reason::MapNotFound);
    drop(service);
    let names_again = service_again(data.path()).await.map_names();
    assert_eq!(names_again.iter().map(ToString::to_string).collect::<Vec<_>>(), names);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn while_maps_fall_asleep_and_wake_no_request_fails_and_nothing_is_lost() {
    const MAPS: usize = 4;
    const SCANS: u64 = 60;
    let data = tempfile::tempdir().unwrap();
    let service = service(data.path());
    for number in 0..MAPS {
        create(&service, number).await;
    }
    let writers: Vec<_> = (0..MAPS)
        .map(|map| {
            let service = service.clone();
            tokio::spawn(async move {
                for scan_id in 0..SCANS {
                    assert_eq!(insert(&service, map, scan_id).await, scan_id + 1);
                    let other = (map + scan_id as usize) % MAPS;
                    assert!(service.map_info(&name(other)).await.unwrap().version.revision <= SCANS);
                    // For so long nobody uses the map.
                    tokio::time::sleep(Duration::from_millis(2)).await;
                }
            })
        })
        .collect();
    while !writers.iter().all(tokio::task::JoinHandle::is_finished) {
        service.put_unused_to_sleep().await;
        assert_eq!(service.list_maps().await.unwrap().len(), MAPS, "each is listed once, asleep or not");
    }
    for writer in writers {
        writer.await.unwrap();
    }
    assert!(service.maps_awake().wakes > 0, "none slept");
    let before = service.list_maps().await.unwrap();
    drop(service);
    let service = service_again(data.path()).await;
    assert_eq!(
        service.maps_awake(),
        MapsAwake { awake: 0, asleep: MAPS, wakes: 0 },
        "looked at, and not kept"
    );
    for (number, before) in before.iter().enumerate() {
        let info = service.map_info(&name(number)).await.unwrap();
        assert_eq!((info.version, info.scans as u64), (before.version, SCANS));
        assert_eq!(info.version.revision, SCANS);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_is_served_before_all_are_open_and_one_that_cannot_be_keeps_no_other_back() {
    let data = tempfile::tempdir().unwrap();
    {
        let service = service(data.path());
        for number in 0..3 {
            create(&service, number).await;
            insert(&service, number, 0).await;
        }
    }
    for folder in std::fs::read_dir(data.path().join("maps")).unwrap().map(Result::unwrap) {
        if folder.file_name().to_string_lossy().starts_with("tile-1.") {
            for file in std::fs::read_dir(folder.path()).unwrap().map(Result::unwrap) {
                std::fs::write(file.path(), "no map").unwrap();
            }
        }
    }
    let (settings, progress) =
        (ServiceSettings { sleep_after: None, ..settings(data.path()) }, OpeningProgress::default());
    let service = loop {
        match MapService::begin(settings.clone(), &progress) {
            Ok(service) => break service,
            Err(_) => tokio::task::yield_now().await,
        }
    };
    assert_eq!(service.opening().map(|opened| (opened.maps, opened.maps_open)), Some((3, 0)));
    assert_eq!(service.map_info(&name(2)).await.unwrap().version.revision, 1);
    assert_eq!(service.map_info(&name(1)).await.unwrap_err().reason, Reason::MapUnavailable);
    assert_eq!(service.maps_awake(), MapsAwake { awake: 1, asleep: 1, wakes: 0 });
    // A list waits until all are open.
    let listing = tokio::spawn({
        let service = service.clone();
        async move { service.list_maps().await.unwrap().len() }
    });
    tokio::task::yield_now().await;
    assert!(!listing.is_finished());
    let opening = service.clone();
    tokio::task::spawn_blocking(move || opening.open_maps()).await.unwrap().unwrap();
    assert_eq!(listing.await.unwrap(), 2);
    assert!(service.opening().is_none());
    let unavailable = service.unavailable_maps();
    assert_eq!(unavailable.iter().map(|map| &map.name).collect::<Vec<_>>(), [&name(1)]);
}
