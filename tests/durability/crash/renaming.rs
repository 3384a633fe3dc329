//! `kill -9` while a map is renamed, there and back, round after round: after each restart there is one map, under the
//! name that was acknowledged last or the one that was asked for then, with all that was put in.

use std::time::Duration;

use mrol::client::{Client, NewMap};
use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::ScanRequest;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::rounds::{LEVELS, RESOLUTION_M, rounds};
use crate::support::process::Process;

fn name(number: u64) -> MapName {
    MapName::new(&format!("depot-{}", number % 3)).unwrap()
}

/// Renames the map and puts a scan in, again and again, until the server is gone: how often each was acknowledged.
async fn work(client: &Client, renamed: &mut u64, inserted: &mut u64) {
    loop {
        if client.rename_map(&name(*renamed), &name(*renamed + 1)).await.is_err() {
            return;
        }
        *renamed += 1;
        let at = Point::new(*inserted as f32, 0.05, 0.05);
        let scan = ScanRequest {
            scan_id: Some(*inserted),
            guess: Guess::Pose(Pose::identity()),
            at_guess: true,
            ..ScanRequest::new(RobotName::new("r").unwrap(), vec![at].into())
        };
        if client.insert_scan(&name(*renamed), scan).await.is_err() {
            return;
        }
        *inserted += 1;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_map_that_is_being_renamed_has_one_name_after_kill_9() {
    let data = tempfile::tempdir().unwrap();
    let folder = data.path().to_str().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut renamed, mut inserted, mut uuid, mut unanswered) = (0, 0, None, 0);
    for round in 0..rounds() {
        let server = Process::start(folder, &[]);
        let client = Client::connect(&server.grpc).await.unwrap();
        if round == 0 {
            let new = NewMap { levels: Some(LEVELS), ..NewMap::of(RESOLUTION_M) };
            uuid = Some(client.create_map(&name(0), new).await.unwrap().0.version.map_uuid);
        }
        let listed = client.list_maps().await.unwrap();
        assert!(listed.unavailable.is_empty(), "round {round}: {:?}", listed.unavailable);
        let [map] = &listed.maps[..] else { panic!("round {round}: {:?}", listed.maps) };
        if map.name == name(renamed + 1) {
            (renamed, unanswered) = (renamed + 1, unanswered + 1);
        }
        assert_eq!(map.name, name(renamed), "round {round}: an acknowledged name is lost");
        assert_eq!(Some(map.version.map_uuid), uuid, "round {round}");
        let revision = map.version.revision;
        assert!([inserted, inserted + 1].contains(&revision), "round {round}: {revision} of {inserted}");
        inserted = revision;
        let kill = async {
            tokio::time::sleep(Duration::from_millis(rng.random_range(5..300))).await;
            server.kill();
        };
        tokio::join!(work(&client, &mut renamed, &mut inserted), kill);
    }
    println!("renamed {renamed} times, {unanswered} of them unanswered; {inserted} scans");
    assert!(renamed > 0 && inserted > 0);
}
