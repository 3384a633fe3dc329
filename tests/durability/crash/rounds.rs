//! `kill -9` at random moments under four writers, on the real program, round after round in one data folder: every
//! acknowledged change is there after each restart, in its order, nothing is half applied, and the map is that of a
//! plain model. Beside them a second map is deleted, made again and restored under its name all the time, on a disk
//! that fails at times while it is made.
//!
//! Twenty rounds; `MROL_CRASH_ROUNDS=200 cargo test --test durability crash -- --nocapture` is the long form.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use mrol::client::{Client, ClientError, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, RequestId, RobotName, SessionName};
use mrol::mapping::Guess;
use mrol::service::{Deletion, DeletionTarget, ListingRequest, ScanRequest, Undo, UndoTarget};
use mrol::voxel::{Lattice, VoxelKey};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tokio::sync::watch;

use super::remaker::{self, Remaker};
use crate::support::disk::Disk;
use crate::support::map_folders::folder_of;
use crate::support::process::Process;
use crate::support::skipped::skipped_in_part;

const WRITERS: usize = 4;
pub(super) const RESOLUTION_M: f64 = 0.1;
pub(super) const LEVELS: u32 = 4;
/// Snapshots are written all the time, beside the writers.
const SYNCED: [&str; 2] = ["--snapshot-journal-mib", "1"];
/// The end of a process takes nothing that was written, synced or not.
const WRITTEN: [&str; 4] = ["--snapshot-journal-mib", "1", "--durability", "100ms"];

pub(super) fn rounds() -> usize {
    std::env::var("MROL_CRASH_ROUNDS").map_or(20, |rounds| rounds.parse().unwrap())
}

fn office() -> MapName {
    MapName::new("office").unwrap()
}

/// Something that a writer wants done, under an id that makes it idempotent.
#[derive(Debug, Clone)]
enum Wish {
    Insert { scan_id: u64, points: Vec<Point> },
    Delete { request_id: RequestId, keys: Vec<VoxelKey> },
    Undo { request_id: RequestId, scan_id: u64 },
}

/// A wish that was acknowledged.
#[derive(Debug, Clone)]
struct Done {
    writer: usize,
    wish: Wish,
    /// Voxels that it added or removed.
    voxels: usize,
}

/// What one writer has done, and what it does not know to be done.
struct Writer {
    number: usize,
    rng: ChaCha8Rng,
    next_id: u64,
    /// Sent, and not answered before the server was gone.
    pending: Option<Wish>,
    done: BTreeMap<u64, Done>,
}

impl Writer {
    fn new(number: usize) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(number as u64);
        Self { number, rng, next_id: 0, pending: None, done: BTreeMap::new() }
    }

    fn robot(&self) -> RobotName {
        RobotName::new(&format!("robot-{}", self.number)).unwrap()
    }

    fn wish(&mut self) -> Wish {
        self.next_id += 1;
        let id = self.next_id;
        let request_id = RequestId::new(&format!("{}-{id}", self.robot())).unwrap();
        if id.is_multiple_of(7) {
            // The last scan before it: others may have seen its voxels too.
            return Wish::Undo {
                request_id,
                scan_id: if (id - 1).is_multiple_of(5) { id - 2 } else { id - 1 },
            };
        }
        if id.is_multiple_of(5) {
            let keys = (0..40).filter_map(|_| VoxelKey::new(index(&mut self.rng))).collect();
            return Wish::Delete { request_id, keys };
        }
        let count = self.rng.random_range(50..3000);
        let point = |index: [i32; 3]| Point::from(index.map(|i| (i as f32 + 0.5) * RESOLUTION_M as f32));
        Wish::Insert { scan_id: id, points: (0..count).map(|_| point(index(&mut self.rng))).collect() }
    }

    /// Has a wish granted: notes the revision that it made.
    async fn grant(&mut self, client: &Client, wish: Wish) -> Result<(), ClientError> {
        self.pending = Some(wish.clone());
        let (version, voxels) = match &wish {
            Wish::Insert { scan_id, points } => {
                let scan = ScanRequest {
                    scan_id: Some(*scan_id),
                    guess: Guess::Pose(Pose::identity()),
                    at_guess: true,
                    strict: true,
                    ..ScanRequest::new(self.robot(), points.clone().into())
                };
                let answer = client.insert_scan(&office(), scan).await?;
                (answer.version, answer.new_voxels)
            }
            Wish::Delete { request_id, keys } => {
                let target = DeletionTarget::Keys(keys.clone());
                let deletion = Deletion { target, level: 0, request_id: Some(request_id.clone()) };
                let answer = client.delete_voxels(&office(), deletion).await?;
                (answer.version, answer.removed)
            }
            Wish::Undo { request_id, scan_id } => {
                let target = UndoTarget::Scan {
                    robot: self.robot(),
                    session: SessionName::default(),
                    scan_id: *scan_id,
                };
                let undo = Undo { target, request_id: Some(request_id.clone()) };
                let answer = client.undo(&office(), undo).await?;
                assert_eq!(answer.scans, 1);
                (answer.version, answer.removed)
            }
        };
        self.pending = None;
        if voxels > 0 || !matches!(wish, Wish::Delete { .. }) {
            let done = Done { writer: self.number, wish, voxels };
            assert!(self.done.insert(version.revision, done).is_none(), "a revision came twice");
        }
        Ok(())
    }

    /// Wishes until the server is gone.
    async fn work(mut self, client: Client, mut gone: watch::Receiver<bool>) -> Self {
        loop {
            let wish = self.wish();
            tokio::select! {
                granted = self.grant(&client, wish) => if granted.is_err() { break },
                _ = gone.wait_for(|gone| *gone) => break,
            }
        }
        self
    }
}

fn index(rng: &mut impl Rng) -> [i32; 3] {
    [rng.random_range(-60..60), rng.random_range(-60..60), rng.random_range(-8..8)]
}

/// Which scans hold each voxel, and who is in the trajectory.
#[derive(Default)]
struct Model {
    revision: u64,
    holders: BTreeMap<VoxelKey, BTreeSet<u64>>,
    trajectory: Vec<(u64, String, Option<u64>)>,
}

impl Model {
    /// Does what was acknowledged, in the order of revisions, of which none may be missing.
    fn follow(&mut self, done: BTreeMap<u64, Done>) {
        let quantize = Lattice::new(RESOLUTION_M, LEVELS).unwrap().from_map();
        for (revision, Done { writer, wish, voxels }) in done {
            assert_eq!(revision, self.revision + 1, "a revision that nobody was told of");
            self.revision = revision;
            let before = self.holders.len();
            match wish {
                Wish::Insert { scan_id, points } => {
                    for &point in &points {
                        self.holders.entry(quantize.key(point).unwrap()).or_default().insert(revision);
                    }
                    self.trajectory.push((revision, format!("robot-{writer}"), Some(scan_id)));
                }
                Wish::Delete { keys, .. } => keys.iter().for_each(|key| {
                    self.holders.remove(key);
                }),
                Wish::Undo { scan_id, .. } => self.undo(&format!("robot-{writer}"), scan_id),
            }
            assert_eq!(self.holders.len().abs_diff(before), voxels, "at revision {revision}");
        }
    }

    fn undo(&mut self, robot: &str, scan_id: u64) {
        let is_meant = |(_, who, id): &(u64, String, Option<u64>)| who == robot && *id == Some(scan_id);
        let place = self.trajectory.iter().position(is_meant).expect("an accepted scan");
        let (scan, ..) = self.trajectory.remove(place);
        self.holders.retain(|_, holders| {
            holders.remove(&scan);
            !holders.is_empty()
        });
    }

    async fn assert_equals(&self, client: &Client, round: usize) {
        let listing = client.list_voxels(&office(), ListingRequest::default()).await.unwrap();
        assert_eq!(listing.version.revision, self.revision, "round {round}");
        let found: BTreeSet<VoxelKey> = listing.keys.into_iter().collect();
        let count = self.holders.len();
        assert!(found.iter().eq(self.holders.keys()), "round {round}: {} voxels, not {count}", found.len());
        let poses = client.trajectory(&office(), None).await.unwrap().poses;
        let found: Vec<_> =
            poses.into_iter().map(|pose| (pose.revision, pose.robot.to_string(), pose.scan_id)).collect();
        assert!(found == self.trajectory, "round {round}: another trajectory");
    }
}

/// The newest of two or more snapshots.
fn newest_snapshot(data: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder_of(data, "office")).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut snapshots: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|extension| extension == "mrol")).collect();
    snapshots.sort_unstable();
    (snapshots.len() > 1).then(|| snapshots.pop()).flatten()
}

fn damage(file: &Path) {
    let mut bytes = std::fs::read(file).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    std::fs::write(file, bytes).unwrap();
}

fn server(data: &Path, disk: Option<&Disk>, options: &[&str]) -> Process {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mrol"));
    command
        .args(["serve", "--json", "--log-level", "error", "--data-dir"])
        .arg(data)
        .args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"])
        .args(options)
        .stderr(Stdio::inherit());
    if let Some(disk) = disk {
        disk.go_on();
        disk.preload(&mut command);
    }
    Process::of(command)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_acknowledged_is_lost_by_kill_9() {
    let disk = Disk::build().map(Arc::new);
    if disk.is_none() {
        skipped_in_part("there is no `cc` to build a disk that fails with");
    }
    let temporary = tempfile::tempdir().unwrap();
    let data = disk.as_ref().map_or(temporary.path().to_owned(), |disk| disk.folder());
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut writers: Vec<Writer> = (0..WRITERS).map(Writer::new).collect();
    let (mut model, mut remaker) = (Model::default(), Remaker::new(disk.clone()));
    let (mut unanswered, mut damaged) = (0, 0);
    for round in 0..rounds() {
        let server = server(&data, disk.as_deref(), if round % 4 == 3 { &WRITTEN[..] } else { &SYNCED });
        let client = Client::connect(&server.grpc).await.unwrap();
        if round == 0 {
            let new = NewMap { levels: Some(LEVELS), ..NewMap::of(RESOLUTION_M) };
            client.create_map(&office(), new).await.unwrap();
        }
        for writer in &mut writers {
            if let Some(wish) = writer.pending.clone() {
                unanswered += 1;
                writer.grant(&client, wish).await.unwrap();
            }
        }
        let done = writers.iter_mut().flat_map(|writer| std::mem::take(&mut writer.done)).collect();
        model.follow(done);
        model.assert_equals(&client, round).await;
        unanswered += remaker.settle(&client, round).await;

        let (tell, gone) = watch::channel(false);
        let working: Vec<_> =
            writers.drain(..).map(|writer| tokio::spawn(writer.work(client.clone(), gone.clone()))).collect();
        let remaking = tokio::spawn(remaker.work(client.clone(), gone.clone()));
        tokio::time::sleep(Duration::from_millis(rng.random_range(20..900))).await;
        server.kill();
        tell.send_replace(true);
        for writer in working {
            writers.push(writer.await.unwrap());
        }
        remaker = remaking.await.unwrap();
        if let Some(newest) = newest_snapshot(&data).filter(|_| round % 3 > 0) {
            damage(&newest);
            damaged += 1;
        }
    }
    println!(
        "{} rounds: {} changes, {} voxels, {unanswered} changes in flight when it was killed, {damaged} starts with a \
         damaged snapshot; {:?}",
        rounds(),
        model.revision,
        model.holders.len(),
        remaker.counts
    );
    let remaker::Counts { created, restored, deleted, inserted, failed } = remaker.counts;
    assert!(created + restored > 1 && deleted > 0 && inserted > 0, "no map was made again");
    assert!(rounds() < 100 || restored > 0, "no map was restored");
    assert!(disk.is_none() || rounds() < 100 || failed > 0, "no creation failed");
    assert!(unanswered > 0 && damaged > 0, "{unanswered} unanswered, {damaged} damaged");
}
