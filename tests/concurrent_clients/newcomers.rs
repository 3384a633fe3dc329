//! Robots of which the map has fewer than two scans, and who ask to be placed by their velocity while another inserts:
//! each is answered. What they wait for must not wait for them.

use std::time::{Duration, Instant};

use mrol::client::Client;
use mrol::geometry::{Point, Pose};
use mrol::map::{MapName, RobotName};
use mrol::mapping::Guess;
use mrol::service::ScanRequest;
use reqwest::StatusCode;
use serde_json::json;

use crate::support::daemon::{Daemon, client, json_of, row};
use crate::support::watchdog::{Beat, Watchdog};
use crate::{MAP, STILL_MAX, seconds};

/// Scans before it begins: whoever looks for a robot's poses looks through all of these.
const BEFORE: usize = 100;

fn map() -> MapName {
    MapName::new(MAP).unwrap()
}

/// A few points; the map grows by little.
fn scan(robot: &str, guess: Guess) -> ScanRequest {
    let points: Vec<Point> = row(60).into_iter().map(Point::from).collect();
    ScanRequest { guess, ..ScanRequest::new(RobotName::new(robot).unwrap(), points.into()) }
}

fn at_origin(robot: &str) -> ScanRequest {
    ScanRequest { at_guess: true, ..scan(robot, Guess::Pose(Pose::identity())) }
}

/// The robot that inserts all the time; how many scans went in.
async fn inserter(client: Client, robot: &'static str, end: Instant, heart: Beat) -> usize {
    let mut inserted = 0;
    while Instant::now() < end {
        assert!(client.insert_scan(&map(), at_origin(robot)).await.expect("an insertion").accepted);
        inserted += 1;
        heart.beat();
    }
    inserted
}

/// A robot without a scan: it is told that it has to say where it is.
async fn stranger(client: Client, end: Instant, heart: Beat) -> usize {
    let mut refused = 0;
    while Instant::now() < end {
        let refusal =
            client.insert_scan(&map(), scan("stranger", Guess::ConstantVelocity)).await.unwrap_err();
        assert_eq!(refusal.reason(), Some("guess_required"), "{refusal}");
        refused += 1;
        heart.beat();
    }
    refused
}

/// A robot with one scan asks for alignments alone, so that it stays at one.
async fn beginner(daemon_url: String, end: Instant, heart: Beat) -> usize {
    let scan =
        json!({"robot": "beginner", "points": row(60), "constant_velocity": true, "method": "overlap"});
    let mut aligned = 0;
    while Instant::now() < end {
        let ask = client().post(format!("{daemon_url}/v1/maps/{MAP}/alignment")).json(&scan).send();
        let answer = ask.await.expect("an answer");
        let status = answer.status();
        let answer = json_of(answer).await;
        assert_eq!(status, StatusCode::OK, "{answer}");
        assert!(answer["verdict"].is_string(), "{answer}");
        aligned += 1;
        heart.beat();
    }
    aligned
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn robots_with_fewer_than_two_scans_ask_for_their_velocity_while_others_insert() {
    let daemon = Daemon::start().await;
    daemon.make_map(MAP).await;
    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    assert!(client.insert_scan(&map(), at_origin("beginner")).await.unwrap().accepted);
    for _ in 0..BEFORE {
        assert!(client.insert_scan(&map(), at_origin("inserter")).await.unwrap().accepted);
    }

    let watchdog = Watchdog::begin(std::process::id(), STILL_MAX);
    let end = Instant::now() + Duration::from_secs(seconds());
    let (inserted, also, refused, aligned) = tokio::join!(
        tokio::spawn(inserter(client.clone(), "inserter", end, watchdog.heart())),
        tokio::spawn(inserter(client.clone(), "another", end, watchdog.heart())),
        tokio::spawn(stranger(client.clone(), end, watchdog.heart())),
        tokio::spawn(beginner(daemon.url(""), end, watchdog.heart())),
    );
    let counts = [inserted, also, refused, aligned].map(|count| count.expect("no panic"));
    println!("{counts:?} inserted by two robots, refused to a stranger, aligned for a beginner");
    assert!(counts.iter().all(|&count| count > 18), "{counts:?}");
    drop(watchdog);
    daemon.stop().await;
}
