//! Who deletes a map, makes it again under its name, empty or of a map file, and puts scans in, until the server is
//! killed. At times the disk fails while the map is made: then there is none. After each restart the map is the
//! incarnation that was acknowledged last, with all that was put into it and nothing of any other.

use std::collections::BTreeSet;
use std::sync::Arc;

use bytes::Bytes;
use mrol::client::{Client, ClientError, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::{ListingRequest, MapInfo, ScanRequest};
use mrol::voxel::{Lattice, VoxelKey};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tokio::sync::watch;
use uuid::Uuid;

use super::rounds::{LEVELS, RESOLUTION_M};
use crate::support::disk::Disk;

/// An incarnation that has seen so many scans is deleted, at the latest.
const SCANS_MAX: u64 = 16;
/// Points far from each other, so that a few scans fill a journal for which a snapshot is due.
const POINTS_MAX: usize = 2000;
const SIDE: i32 = 2000;
/// Each incarnation has a plane of its own, until these are used up.
const PLANES: i32 = 200;

/// One life of the map.
#[derive(Debug, Clone, PartialEq)]
struct Incarnation {
    uuid: Uuid,
    revision: u64,
    voxels: BTreeSet<VoxelKey>,
    scan_ids: Vec<u64>,
}

#[derive(Debug, Clone)]
enum Wish {
    Create,
    Restore,
    Insert { scan_id: u64, points: Vec<Point> },
    Delete,
}

/// What it has done.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub created: usize,
    pub restored: usize,
    pub deleted: usize,
    pub inserted: usize,
    /// Creations and restores that a failing disk kept from happening.
    pub failed: usize,
}

pub(crate) struct Remaker {
    rng: ChaCha8Rng,
    plane: i32,
    /// As it was acknowledged; none where there is no map.
    there: Option<Incarnation>,
    /// Sent, and not answered before the server was gone.
    pending: Option<Wish>,
    /// A map file, and what is in it.
    file: Option<(Bytes, Incarnation)>,
    /// Of every incarnation there ever was.
    uuids: BTreeSet<Uuid>,
    /// Fails while the map is made; none where it cannot.
    disk: Option<Arc<Disk>>,
    pub counts: Counts,
}

/// In the paths of its files, finished and unfinished.
const FOLDER: &str = "depot.";

fn depot() -> MapName {
    MapName::new("depot").unwrap()
}

fn is_not_found(error: &ClientError) -> bool {
    error.reason() == Some("map_not_found")
}

impl Remaker {
    pub(crate) fn new(disk: Option<Arc<Disk>>) -> Self {
        Self {
            rng: ChaCha8Rng::seed_from_u64(99),
            plane: 0,
            there: None,
            pending: None,
            file: None,
            uuids: BTreeSet::new(),
            disk,
            counts: Counts::default(),
        }
    }

    /// What comes next.
    fn wish(&mut self) -> Wish {
        let Some(there) = &self.there else {
            self.plane += 1;
            return if self.file.is_some() && self.rng.random_bool(0.5) {
                Wish::Restore
            } else {
                Wish::Create
            };
        };
        let scans = there.scan_ids.len() as u64;
        if scans > 0 && self.rng.random_range(0..SCANS_MAX) < scans {
            return Wish::Delete;
        }
        let index = |rng: &mut ChaCha8Rng| {
            [rng.random_range(-SIDE..SIDE), rng.random_range(-SIDE..SIDE), self.plane % PLANES]
        };
        let count = self.rng.random_range(1..POINTS_MAX);
        let points = (0..count).map(|_| center(index(&mut self.rng))).collect();
        Wish::Insert { scan_id: there.scan_ids.last().copied().unwrap_or_default() + 1, points }
    }

    /// Has a wish granted, of which it is known that it was not yet or that twice is as once.
    async fn grant(&mut self, client: &Client, wish: Wish) -> Result<(), ClientError> {
        self.pending = Some(wish.clone());
        match wish {
            Wish::Create => {
                let new = NewMap { levels: Some(LEVELS), ..NewMap::of(RESOLUTION_M) };
                let (info, created) = client.create_map(&depot(), new).await?;
                assert!(created, "a map that was deleted is there");
                self.begin(&info, None);
                self.counts.created += 1;
            }
            Wish::Restore => {
                let (file, held) = self.file.clone().expect("a file");
                let info = client.restore_map(&depot(), file).await?;
                self.begin(&info, Some(held));
                self.counts.restored += 1;
            }
            Wish::Delete => {
                client.delete_map(&depot()).await?;
                self.there = None;
                self.counts.deleted += 1;
            }
            Wish::Insert { scan_id, points } => self.insert(client, scan_id, points).await?,
        }
        self.pending = None;
        Ok(())
    }

    async fn insert(&mut self, client: &Client, scan_id: u64, points: Vec<Point>) -> Result<(), ClientError> {
        let scan = ScanRequest {
            scan_id: Some(scan_id),
            guess: Guess::Pose(Pose::identity()),
            at_guess: true,
            strict: true,
            ..ScanRequest::new(RobotName::new("remaker").unwrap(), points.clone().into())
        };
        let answer = client.insert_scan(&depot(), scan).await?;
        let there = self.there.as_mut().expect("a map");
        assert_eq!(answer.version.map_uuid, there.uuid, "another incarnation answered");
        assert_eq!(answer.version.revision, there.revision + 1, "{scan_id}");
        let quantize = Lattice::new(RESOLUTION_M, LEVELS).unwrap().from_map();
        let before = there.voxels.len();
        there.voxels.extend(points.iter().map(|&point| quantize.key(point).unwrap()));
        assert_eq!(answer.new_voxels, there.voxels.len() - before, "{scan_id}");
        there.revision += 1;
        there.scan_ids.push(scan_id);
        self.counts.inserted += 1;
        Ok(())
    }

    /// Notes a map that was made, empty or of a file.
    fn begin(&mut self, info: &MapInfo, held: Option<Incarnation>) {
        let uuid = info.version.map_uuid;
        assert!(self.uuids.insert(uuid), "{uuid} was there before");
        let empty = Incarnation { uuid, revision: 0, voxels: BTreeSet::new(), scan_ids: Vec::new() };
        let there = held.map_or(empty, |held| Incarnation { uuid, ..held });
        assert_eq!(info.version.revision, there.revision);
        self.there = Some(there);
    }

    /// Works until the server is gone.
    pub(crate) async fn work(mut self, client: Client, mut gone: watch::Receiver<bool>) -> Self {
        loop {
            tokio::select! {
                done = self.step(&client) => if done.is_err() { break },
                _ = gone.wait_for(|gone| *gone) => break,
            }
        }
        self
    }

    async fn step(&mut self, client: &Client) -> Result<(), ClientError> {
        let wish = self.wish();
        let makes = matches!(wish, Wish::Create | Wish::Restore);
        match self.disk.clone().filter(|_| makes && self.rng.random_bool(0.5)) {
            Some(disk) => self.grant_on_failing_disk(client, wish, &disk).await?,
            None => self.grant(client, wish).await?,
        }
        if let Some(there) = self.there.clone().filter(|_| self.rng.random_bool(0.4)) {
            self.file = Some((client.snapshot_map(&depot()).await?, there));
        }
        Ok(())
    }

    /// Where an operation on the map's folder fails there is no map afterwards, and never will be.
    async fn grant_on_failing_disk(
        &mut self,
        client: &Client,
        wish: Wish,
        disk: &Disk,
    ) -> Result<(), ClientError> {
        disk.fail(FOLDER);
        let granted = self.grant(client, wish).await;
        disk.go_on();
        match granted {
            Err(error) if error.reason() == Some("not_stored") => {
                self.pending = None;
                self.counts.failed += 1;
                Ok(())
            }
            other => other,
        }
    }

    /// After a restart: what was asked for and not answered happened as a whole or not at all, and is granted now. Then
    /// the map is what it has to be.
    pub(crate) async fn settle(&mut self, client: &Client, round: usize) -> usize {
        let pending = self.pending.take();
        let unanswered = usize::from(pending.is_some());
        let info = match client.map_info(&depot()).await {
            Ok(info) => Some(info),
            Err(error) if is_not_found(&error) => None,
            Err(error) => panic!("round {round}: {error}"),
        };
        match (pending, info) {
            (Some(Wish::Create), Some(info)) => self.begin(&info, None),
            (Some(Wish::Restore), Some(info)) => {
                let held = self.file.clone().map(|(_, held)| held);
                self.begin(&info, held);
            }
            (Some(Wish::Delete), None) => self.there = None,
            (Some(wish), _) => self.grant(client, wish).await.unwrap(),
            (None, _) => {}
        }
        self.assert_there(client, round).await;
        unanswered
    }

    async fn assert_there(&self, client: &Client, round: usize) {
        let Some(there) = &self.there else {
            let error = client.map_info(&depot()).await.expect_err("a map that was deleted came back");
            assert!(is_not_found(&error), "round {round}: {error}");
            return;
        };
        let listing = client.list_voxels(&depot(), ListingRequest::default()).await.unwrap();
        let trajectory = client.trajectory(&depot(), None).await.unwrap();
        let found = Incarnation {
            uuid: listing.version.map_uuid,
            revision: listing.version.revision,
            voxels: listing.keys.into_iter().collect(),
            scan_ids: trajectory.poses.iter().filter_map(|pose| pose.scan_id).collect(),
        };
        let planes = |incarnation: &Incarnation| -> BTreeSet<i32> {
            incarnation.voxels.iter().map(|key| key.index()[2]).collect()
        };
        // Of poses so near to each other that undo reaches no more, those of a map file, some are thinned.
        let mut kept = found.scan_ids.iter();
        let thinned = there.scan_ids.last() == found.scan_ids.last()
            && kept.all(|scan_id| there.scan_ids.contains(scan_id));
        let expected = Incarnation { scan_ids: found.scan_ids.clone(), ..there.clone() };
        assert!(
            thinned && found == expected,
            "round {round}: {} revision {} scans {:?} planes {:?}, not {} {} {:?} {:?}",
            found.uuid,
            found.revision,
            found.scan_ids,
            planes(&found),
            there.uuid,
            there.revision,
            there.scan_ids,
            planes(there)
        );
    }
}

fn center(index: [i32; 3]) -> Point {
    Point::from(index.map(|i| (i as f32 + 0.5) * RESOLUTION_M as f32))
}
