//! Copies of a map with viewpoints, over random histories, against the map and a plain model.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use rand::seq::{IndexedRandom, IteratorRandom};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::copy::Builder;
use super::error::ReplicaError;
use super::options::ReplicaOptions;
use crate::wire::pb;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{
    Change, DeletionRecord, MapName, MapSettings, MappedScan, Region, RobotName, ScanRecord, UndoRecord,
    ViewpointRecord,
};
use mrol_map::visibility::{IMAGE_BYTES_MAX, RangeImage, Sweep, ViewpointSet};
use mrol_map::voxel::VoxelKey;
use mrol_service::{MapService, ServiceSettings, Watch, WatchEvent, WatchForm, WatchMessage, WatchRequest};
use mrol_store::{OpeningProgress, StoreSettings};

/// How long a thread may hold the folder of a service that ended.
const PATIENCE: Duration = Duration::from_secs(60);

fn map() -> MapName {
    MapName::new("a").unwrap()
}

fn region() -> Region {
    Region::cuboid([0.0, -1.0, -1.0], [3.0, 1.0, 1.0]).unwrap()
}

/// What a scan saw of a wall ahead.
fn image(distance_m: f32) -> RangeImage {
    let points: Vec<_> = (0..9).map(|i| Point::new(distance_m, 0.2 * i as f32, 0.1)).collect();
    RangeImage::of_points(&points, Sweep::standing(90.0), 8192).unwrap()
}

/// A client that has a copy, and reconnects now and then.
struct Follower {
    options: ReplicaOptions,
    builder: Builder,
    watch: Option<Watch>,
}

impl Follower {
    fn new(options: ReplicaOptions) -> Self {
        Self { options, builder: Builder::new(&options), watch: None }
    }

    /// Goes on from where the copy is.
    async fn begin(&mut self, service: &MapService) {
        self.builder.begin();
        let since = self.builder.since();
        let (region, viewpoints) = (self.options.region, self.options.viewpoint_bytes_max > 0);
        let request = WatchRequest { since, region, form: WatchForm::Changes, viewpoints };
        self.watch = Some(service.watch(&map(), request).await.unwrap());
    }

    async fn read_to(&mut self, service: &MapService, revision: u64) {
        if self.watch.is_none() {
            self.begin(service).await;
        }
        while self.builder.copied().is_none_or(|copied| copied.map.revision() < revision) {
            let message = self.watch.as_mut().unwrap().next().await.unwrap();
            // As it goes over the wire.
            let message = WatchMessage::try_from(pb::WatchResponse::from(message)).unwrap();
            self.builder.apply(message).unwrap();
        }
    }

    fn viewpoints(&self) -> std::sync::Arc<ViewpointSet> {
        self.builder.copied().unwrap().map.viewpoints()
    }
}

/// Which viewpoints the map should have, and which scans can be undone.
#[derive(Default)]
struct Model {
    viewpoints: BTreeMap<u64, RangeImage>,
    scans: BTreeSet<u64>,
}

impl Model {
    fn scan(&mut self, random: &mut ChaCha8Rng, revision: u64) -> Change {
        let voxels = (0..20).filter_map(|_| VoxelKey::new([random.random_range(-40..40), 0, 1])).collect();
        let pose = Pose::translation(random.random_range(-20.0..20.0), 0.0, 0.0);
        let pose = MappedScan::new(RobotName::new("r").unwrap(), pose);
        let viewpoint = random.random_bool(0.7).then(|| {
            let most = random.random_range(0..3);
            let displaced: BTreeSet<u64> =
                self.viewpoints.keys().copied().sample(random, most).into_iter().collect();
            self.viewpoints.retain(|scan, _| !displaced.contains(scan));
            let image = image(random.random_range(1.0..8.0));
            self.viewpoints.insert(revision, image.clone());
            ViewpointRecord { image, displaced: displaced.into_iter().collect() }
        });
        self.scans.insert(revision);
        Change::Insertion(ScanRecord { viewpoint, ..ScanRecord::of_voxels(pose, voxels) })
    }

    fn undo(&mut self, random: &mut ChaCha8Rng) -> Change {
        let scans: Vec<u64> = self.scans.iter().copied().collect();
        let scans: Vec<u64> = scans.choose(random).copied().into_iter().collect();
        self.scans.retain(|scan| !scans.contains(scan));
        self.viewpoints.retain(|scan, _| !scans.contains(scan));
        Change::Undo(UndoRecord { scans, ..UndoRecord::default() })
    }

    fn is_of(&self, viewpoints: &ViewpointSet) -> bool {
        let found = viewpoints.iter().map(|(revision, it)| (revision, it.image()));
        found.eq(self.viewpoints.iter().map(|(revision, image)| (*revision, image)))
    }
}

fn open(data: &std::path::Path, watch_bytes_max: usize) -> MapService {
    let store = StoreSettings { watch_bytes_max, ..StoreSettings::default() };
    let settings = ServiceSettings { data_dir: Some(data.to_owned()), store, ..ServiceSettings::default() };
    let begin = std::time::Instant::now();
    loop {
        // Threads of the service before may hold the folder for a moment.
        match MapService::open(settings.clone(), &OpeningProgress::default()) {
            Ok(service) => return service,
            Err(error) => assert!(begin.elapsed() < PATIENCE, "{error}"),
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Those of a map that a copy of the region must have, since they saw a point of it.
fn seen_in_region(viewpoints: &ViewpointSet) -> Vec<u64> {
    let points = (0..30).flat_map(|i| (-5..5).map(move |j| [f64::from(i) * 0.1, f64::from(j) * 0.2, 0.02]));
    let points: Vec<_> = points.collect();
    let has_seen = |revision: &u64| {
        let viewpoint = viewpoints.get(*revision).unwrap();
        points.iter().any(|point| region().contains(*point) && viewpoint.is_free(*point))
    };
    viewpoints.iter().map(|(revision, _)| revision).filter(has_seen).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn copies_have_the_viewpoints_of_the_map_at_every_revision() {
    let (mut in_region, mut elsewhere) = (0, 0);
    for seed in 0..3 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let data = tempfile::tempdir().unwrap();
        // Of a ring that holds everything, or nothing: then changes come from the journal.
        let ring = [64 << 20, 0][seed as usize % 2];
        let mut service = open(data.path(), ring);
        service.create_map(map(), MapSettings::new(0.1, 4)).await.unwrap();
        let mut model = Model::default();
        let mut whole = Follower::new(ReplicaOptions::default());
        let mut part = Follower::new(ReplicaOptions { region: Some(region()), ..ReplicaOptions::default() });
        let mut blind = Follower::new(ReplicaOptions { viewpoint_bytes_max: 0, ..ReplicaOptions::default() });
        let mut revision = 0;
        for _ in 0..40 {
            for _ in 0..random.random_range(1..4) {
                let change = match random.random_range(0..10) {
                    0 | 1 if !model.scans.is_empty() => model.undo(&mut random),
                    2 => {
                        let voxels = service.map_itself(&map()).view().voxels().iter().take(3).collect();
                        Change::Deletion(DeletionRecord { voxels, request: None })
                    }
                    _ => model.scan(&mut random, revision + 1),
                };
                let is_empty = matches!(&change, Change::Deletion(deletion) if deletion.voxels.is_empty());
                if !is_empty {
                    revision = service.make_change(&map(), change).await;
                }
            }
            match random.random_range(0..8) {
                0 => drop(service.save().await.unwrap()),
                1 => {
                    service.save().await.unwrap();
                    [&mut whole, &mut part, &mut blind].into_iter().for_each(|it| it.watch = None);
                    drop(std::mem::replace(&mut service, open(&data.path().join("other"), ring)));
                    service = open(data.path(), ring);
                }
                2 => whole.watch = None,
                // A copy that begins anew is told of the state.
                3 => whole = Follower::new(ReplicaOptions::default()),
                4 => part = Follower::new(part.options),
                _ => {}
            }
            let viewpoints = service.map_itself(&map()).viewpoints();
            assert!(model.is_of(&viewpoints), "seed {seed}, revision {revision}: the map's are others");
            for follower in [&mut whole, &mut part, &mut blind] {
                follower.read_to(&service, revision).await;
            }
            assert!(
                whole.viewpoints() == viewpoints,
                "seed {seed}, revision {revision}: the copy's are others"
            );
            assert!(blind.viewpoints().is_empty());
            let of_part: Vec<u64> = part.viewpoints().iter().map(|(revision, _)| revision).collect();
            let needed = seen_in_region(&viewpoints);
            assert!(needed.iter().all(|revision| of_part.contains(revision)), "{needed:?} of {of_part:?}");
            for (revision, viewpoint) in part.viewpoints().iter() {
                assert_eq!(viewpoints.get(revision), Some(viewpoint));
            }
            in_region += needed.len();
            elsewhere += viewpoints.len() - of_part.len();
        }
    }
    assert!(in_region > 20 && elsewhere > 50, "{in_region} in the region, {elsewhere} elsewhere");
}

#[tokio::test(flavor = "multi_thread")]
async fn viewpoints_of_a_state_come_in_parts_that_are_bounded() {
    let service = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
    service.create_map(map(), MapSettings::new(0.1, 4)).await.unwrap();
    let points: Vec<_> = (0..40_000)
        .map(|i| {
            let turn = i as f32 * 0.01;
            Point::new(5.0 * turn.cos(), 5.0 * turn.sin(), (i % 100) as f32 * 0.05)
        })
        .collect();
    let image = RangeImage::of_points(&points, Sweep::standing(90.0), IMAGE_BYTES_MAX).unwrap();
    assert!(image.stored_bytes() > 2000, "{}", image.stored_bytes());
    let most = 300 * 1024 / image.stored_bytes();
    for _ in 0..2 * most {
        let viewpoint = Some(ViewpointRecord { image: image.clone(), displaced: vec![] });
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        let scan = ScanRecord::of_voxels(pose, VoxelKey::new([1, 2, 3]).into_iter().collect());
        service.make_change(&map(), Change::Insertion(ScanRecord { viewpoint, ..scan })).await;
    }
    let mut told =
        service.watch(&map(), WatchRequest { viewpoints: true, ..WatchRequest::default() }).await.unwrap();
    let (mut parts, mut viewpoints) = (0, 0);
    loop {
        let message = told.next().await.unwrap();
        let bytes = prost::Message::encoded_len(&pb::WatchResponse::from(message.clone()));
        assert!(bytes < 320 * 1024, "{bytes} bytes");
        let WatchEvent::State(part) = message.event else { panic!("{message:?}") };
        parts += 1;
        viewpoints += part.viewpoints.len();
        if part.is_last {
            break;
        }
    }
    assert_eq!(viewpoints, 2 * most);
    assert!((3..6).contains(&parts), "{parts} parts");
    let mut plain = service.watch(&map(), WatchRequest::default()).await.unwrap();
    let WatchEvent::State(part) = plain.next().await.unwrap().event else { panic!("no state") };
    assert!(part.is_last && part.viewpoints.is_empty(), "who does not ask for viewpoints pays nothing");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_copy_takes_neither_more_viewpoints_than_it_may_have_nor_damaged_ones() {
    let service = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
    service.create_map(map(), MapSettings::new(0.1, 4)).await.unwrap();
    let mut model = Model::default();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    while model.viewpoints.is_empty() {
        let change = model.scan(&mut random, 1);
        service.make_change(&map(), change).await;
        model.scans.clear();
    }
    let request = WatchRequest { viewpoints: true, ..WatchRequest::default() };
    let mut told = service.watch(&map(), request).await.unwrap();
    let state = [told.next().await.unwrap(), told.next().await.unwrap()];
    let taken = |options: ReplicaOptions, change: &dyn Fn(&mut pb::Viewpoint)| {
        let mut builder = Builder::new(&options);
        let applied = state.clone().map(|message| {
            let mut message = pb::WatchResponse::from(message);
            if let Some(pb::watch_response::Event::State(part)) = &mut message.event {
                part.viewpoints.iter_mut().for_each(change);
            }
            builder.apply(message.try_into().unwrap())
        });
        applied.into_iter().collect::<Result<Vec<_>, _>>().map(|_| ())
    };
    taken(ReplicaOptions::default(), &|_| {}).unwrap();
    let small = ReplicaOptions { viewpoint_bytes_max: 10, ..ReplicaOptions::default() };
    assert!(matches!(taken(small, &|_| {}), Err(ReplicaError::TooManyViewpoints(10))));
    let refused = |change: &dyn Fn(&mut pb::Viewpoint)| {
        taken(ReplicaOptions::default(), change).unwrap_err().to_string()
    };
    assert!(refused(&|it| it.image = it.image.slice(..9)).contains("a range image of 9 bytes"));
    assert!(refused(&|it| it.image = vec![0; 8193].into()).contains("of 8193 bytes, at most 8192"));
    assert!(refused(&|it| it.revision = 99).contains("a viewpoint of revision 99"));
}
