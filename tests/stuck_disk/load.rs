//! Every operation of the server, each again and again, on both maps in turn.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use mrol::wire::pb;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tokio::task::JoinSet;

use crate::MAPS;
use crate::calls::{Calls, DEADLINE};
use crate::pace::Pace;
use crate::report::{Bound, Report};
use crate::requests;
use crate::support::daemon::{bytes_of, query_pb, row};

/// The robots that map.
const ROBOTS: [&str; 3] = ["r1", "r2", "r3"];
/// Scans of a robot before another of its kind comes, of whom the map knows nothing yet.
const SCANS_OF_NEWCOMER: u64 = 4;
const QUERY_POINTS: [usize; 3] = [1_000, 10_000, 100_000];

/// The tasks that ask.
pub(crate) struct Load {
    tasks: JoinSet<()>,
    enough: Arc<AtomicBool>,
}

/// What a task asks with.
#[derive(Clone)]
struct Asker {
    calls: Calls,
    pace: Arc<Pace>,
    enough: Arc<AtomicBool>,
}

impl Load {
    /// Makes the maps and begins.
    pub(crate) async fn begin(http: &str, grpc: &str, report: Arc<Report>, is_governed: bool) -> Self {
        let calls = Calls::connect(http, grpc, report).await;
        for map in MAPS {
            let mut maps = calls.grpc.maps();
            maps.create_map(requests::creation(map)).await.expect("a map");
        }
        let (pace, enough) = (Arc::new(Pace::begin(is_governed)), Arc::new(AtomicBool::new(false)));
        let asker = Asker { calls, pace, enough: Arc::clone(&enough) };
        let mut tasks = JoinSet::new();
        for robot in ROBOTS {
            tasks.spawn(asker.clone().maps(robot, u64::MAX));
        }
        tasks.spawn(asker.clone().maps("newcomer", SCANS_OF_NEWCOMER));
        for points in QUERY_POINTS {
            tasks.spawn(asker.clone().queries(points));
        }
        tasks.spawn(asker.clone().aligns());
        tasks.spawn(asker.clone().looks());
        tasks.spawn(asker.clone().looks_by_http());
        tasks.spawn(asker.clone().probes());
        tasks.spawn(asker.clone().deletes());
        tasks.spawn(asker.clone().undoes());
        tasks.spawn(asker.clone().localizes());
        tasks.spawn(asker.clone().backs_up());
        tasks.spawn(asker.clone().backs_up_by_http());
        tasks.spawn(asker.makes_again());
        Self { tasks, enough }
    }

    /// Waits until every task has its last answer.
    pub(crate) async fn end(self) {
        self.enough.store(true, Ordering::Relaxed);
        self.tasks.join_all().await;
    }
}

impl Asker {
    /// Pauses; the next number and its map, while there is not enough.
    async fn next(&self, i: &mut u64) -> Option<&'static str> {
        self.pace.pause().await;
        *i += 1;
        (!self.enough.load(Ordering::Relaxed)).then(|| MAPS[*i as usize % MAPS.len()])
    }

    fn random(seed: &str) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(seed.bytes().map(u64::from).sum())
    }

    /// A robot maps; after some scans another takes its place.
    async fn maps(self, name: &'static str, scans_max: u64) {
        let (mut i, mut random) = (0, Self::random(name));
        while let Some(map) = self.next(&mut i).await {
            // Both maps get every kind of guess, since their numbers are not even.
            let (number, id) = (i / MAPS.len() as u64 / scans_max, i / MAPS.len() as u64 % scans_max);
            let robot = if scans_max == u64::MAX { name.to_owned() } else { format!("{name}-{number}") };
            // A newcomer's first word is its velocity.
            let id = if scans_max == u64::MAX { id } else { id + 3 };
            let scan = requests::scan(&mut random, map, &robot, id);
            let kind = format!("{} {map}", if scans_max == u64::MAX { "insert" } else { "insert newcomer" });
            let insert = async |scan| self.calls.grpc.mapping().insert_scan(scan).await;
            self.calls.call(&kind, scan, insert).await;
        }
    }

    async fn queries(self, points: usize) {
        let (mut i, points_sent) = (0, row(points));
        let messages = MAPS.map(|map| query_pb(map, &points_sent));
        let body = bytes::Bytes::from(bytes_of(&points_sent));
        while let Some(map) = self.next(&mut i).await {
            let kind = format!("query {points} {map}");
            let query = async |query| Ok(self.calls.grpc.occupancy().query_points(query).await?.into_inner());
            let message = messages[i as usize % MAPS.len()].clone();
            self.calls.call_within(&kind, Bound::Answer, message, query).await;
            let post = |http: &reqwest::Client, url: &str| {
                http.post(format!("{url}/v1/maps/{map}/occupancy"))
                    .header("content-type", "application/octet-stream")
                    .body(body.clone())
            };
            self.calls.request(&format!("HTTP {kind}"), Bound::Answer, post).await;
        }
    }

    async fn aligns(self) {
        let (mut i, mut random) = (0, Self::random("aligns"));
        while let Some(map) = self.next(&mut i).await {
            let scan = requests::alignment(&mut random, map, ROBOTS[i as usize % 3], i / 2);
            let align = async |scan| self.calls.grpc.mapping().align_scan(scan).await;
            self.calls.call(&format!("align {map}"), scan, align).await;
        }
    }

    /// Listings, descriptions, trajectories.
    async fn looks(self) {
        let mut i = 0;
        while let Some(map) = self.next(&mut i).await {
            let message = pb::ListVoxelsRequest { map: map.into(), ..Default::default() };
            let list = async |message| self.calls.grpc.occupancy().list_voxels(message).await;
            self.calls.stream(&format!("list voxels {map}"), message, list).await;
            let describe = async |message| self.calls.grpc.maps().get_map(message).await;
            self.calls
                .call(&format!("describe {map}"), pb::GetMapRequest { map: map.into() }, describe)
                .await;
            let describe = async |message| self.calls.grpc.maps().list_maps(message).await;
            self.calls.call("describe all", pb::ListMapsRequest {}, describe).await;
            let message = pb::GetTrajectoryRequest { map: map.into(), ..Default::default() };
            let tell = async |message| self.calls.grpc.mapping().get_trajectory(message).await;
            self.calls.call(&format!("trajectory {map}"), message, tell).await;
        }
    }

    async fn looks_by_http(self) {
        let mut i = 0;
        while let Some(map) = self.next(&mut i).await {
            for path in ["", "/voxels?level=1", "/trajectory"] {
                let get = |http: &reqwest::Client, url: &str| http.get(format!("{url}/v1/maps/{map}{path}"));
                self.calls.request(&format!("HTTP map{path} {map}"), Bound::None, get).await;
            }
            let get = |http: &reqwest::Client, url: &str| http.get(format!("{url}/v1/maps"));
            self.calls.request("HTTP maps", Bound::None, get).await;
        }
    }

    /// What orchestrators and Prometheus ask.
    async fn probes(self) {
        let mut i = 0;
        while self.next(&mut i).await.is_some() {
            for path in ["/metrics", "/readyz"] {
                let get = |http: &reqwest::Client, url: &str| http.get(format!("{url}{path}"));
                self.calls.request(&format!("HTTP {path}"), Bound::None, get).await;
            }
        }
    }

    async fn deletes(self) {
        let (mut i, mut random) = (0, Self::random("deletes"));
        while let Some(map) = self.next(&mut i).await {
            let delete = async |message| self.calls.grpc.mapping().delete_voxels(message).await;
            let deletion = requests::deletion(&mut random, map);
            self.calls.call(&format!("delete {map}"), deletion, delete).await;
        }
    }

    /// A robot whose scans are all taken out again.
    async fn undoes(self) {
        let (mut i, mut random) = (0, Self::random("undoes"));
        while let Some(map) = self.next(&mut i).await {
            let mut scan = requests::scan(&mut random, map, "undone", i);
            scan.at_guess = true;
            scan.guess = crate::support::daemon::guess_pb([0.0; 3]);
            let insert = async |scan| self.calls.grpc.mapping().insert_scan(scan).await;
            if self.calls.call(&format!("insert {map}"), scan, insert).await.is_some() {
                let undo = async |message| self.calls.grpc.mapping().undo(message).await;
                self.calls.call(&format!("undo {map}"), requests::undo(map, "undone", i), undo).await;
            }
        }
    }

    async fn localizes(self) {
        let mut i = 0;
        while let Some(map) = self.next(&mut i).await {
            let localize = async |message| self.calls.grpc.mapping().localize(message).await;
            self.calls.call(&format!("localize {map}"), requests::localization(map), localize).await;
        }
    }

    /// A map out of the server, in again under another name, and away.
    async fn backs_up(self) {
        let mut i = 0;
        while let Some(map) = self.next(&mut i).await {
            let message = pb::SnapshotMapRequest { map: map.into() };
            let take = async |message| self.calls.grpc.maps().snapshot_map(message).await;
            let Some(pieces) = self.calls.stream(&format!("snapshot {map}"), message, take).await else {
                continue;
            };
            let copy = format!("{map}-restored");
            let piece = |piece: pb::SnapshotMapResponse| pb::RestoreMapRequest {
                replace: false,
                map: copy.clone(),
                data: piece.data,
            };
            let pieces: Vec<_> = pieces.into_iter().map(piece).collect();
            let restore = async |request: tonic::Request<Vec<_>>| {
                let request = request.map(tokio_stream::iter);
                self.calls.grpc.maps().restore_map(request).await
            };
            self.calls.call(&format!("restore {map}"), pieces, restore).await;
            self.forget(&copy).await;
        }
    }

    async fn backs_up_by_http(self) {
        let mut i = 0;
        while let Some(map) = self.next(&mut i).await {
            let get = |http: &reqwest::Client, url: &str| http.get(format!("{url}/v1/maps/{map}/snapshot"));
            let kind = format!("HTTP snapshot {map}");
            let Some(file) = self.calls.request(&kind, Bound::None, get).await else { continue };
            let copy = format!("{map}-put");
            let put = |http: &reqwest::Client, url: &str| {
                http.put(format!("{url}/v1/maps/{copy}/snapshot"))
                    .header("content-type", "application/octet-stream")
                    .body(file)
            };
            self.calls.request(&format!("HTTP restore {map}"), Bound::None, put).await;
            let delete = |http: &reqwest::Client, url: &str| http.delete(format!("{url}/v1/maps/{copy}"));
            self.calls.request(&format!("HTTP remove {map}"), Bound::None, delete).await;
        }
    }

    /// A map is deleted and made again under its name, with a scan in it.
    async fn makes_again(self) {
        let (mut i, mut random) = (0, Self::random("makes again"));
        while let Some(map) = self.next(&mut i).await {
            let map = format!("{map}-again");
            let create = async |message| self.calls.grpc.maps().create_map(message).await;
            self.calls.call("create", requests::creation(&map), create).await;
            let mut scan = requests::scan(&mut random, &map, "r1", i);
            scan.at_guess = true;
            scan.guess = crate::support::daemon::guess_pb([0.0; 3]);
            let insert = async |scan| self.calls.grpc.mapping().insert_scan(scan).await;
            self.calls.call("insert in new map", scan, insert).await;
            self.forget(&map).await;
        }
    }

    async fn forget(&self, map: &str) {
        let remove = async |message| self.calls.grpc.maps().delete_map(message).await;
        self.calls.call("remove", pb::DeleteMapRequest { map: map.into() }, remove).await;
    }
}

const _: () = assert!(DEADLINE.as_secs() < 5, "a hang lasts longer than a deadline");
