//! Keys take turns at the threads for questions.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use mrol::access::Scope;
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};
use tokio::task::JoinSet;

use super::keyring::{Guarded, Keyring};

const MANY: usize = 60;
const WAITING: &str = r#"mrol_jobs_waiting{pool="planning"} "#;

/// How far some spheres are from a voxel, at so many poses.
fn question(poses: usize) -> Value {
    let spheres: Vec<[f32; 4]> = (0..50).map(|i| [0.0, 0.0, i as f32 * 0.01, 0.01]).collect();
    let poses: Vec<[f32; 7]> = (0..poses).map(|i| [i as f32 * 1e-4, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0]).collect();
    json!({"body": {"links": [{"spheres": spheres}]}, "configurations": poses, "answer": "clearance"})
}

/// Questions that wait for a thread.
async fn waiting(server: &Guarded) -> usize {
    let metrics =
        server.http(Method::GET, "/metrics", Some(&server.master), None).await.text().await.unwrap();
    metrics.lines().find_map(|line| line.strip_prefix(WAITING)).unwrap().parse().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_that_asks_much_keeps_no_other_from_asking() {
    let fill = |keyring: &Keyring| ["many", "one"].map(|name| keyring.add(name, Scope::Read, None));
    let (server, [many, one]) = Guarded::start_configured(fill, |config| {
        config.threads.query = 1;
        config.limits.scrape_kept_s = 0.0;
        config.limits.question_time_max_s = 600.0;
    })
    .await;
    server.make_map("a").await;
    let (server, asked, answered) = (Arc::new(server), question(800), Arc::new(AtomicUsize::new(0)));
    let mut asking = JoinSet::new();
    for _ in 0..MANY {
        let (server, asked, many) = (Arc::clone(&server), asked.clone(), many.clone());
        let answered = Arc::clone(&answered);
        asking.spawn(async move {
            let answer = server.http(Method::POST, "/v1/maps/a/poses", Some(&many), Some(asked)).await;
            assert_eq!(answer.status(), StatusCode::OK);
            answered.fetch_add(1, Ordering::SeqCst)
        });
    }
    while waiting(&server).await < MANY * 4 / 5 {
        tokio::task::yield_now().await;
    }
    let answer = server.http(Method::POST, "/v1/maps/a/poses", Some(&one), Some(question(1))).await;
    assert_eq!(answer.status(), StatusCode::OK);
    let before = answered.load(Ordering::SeqCst);
    // The question in hand and those before it; in the order in which they came it would have been the last.
    assert!(before < MANY / 2, "{before} of {MANY} were answered first");
    asking.shutdown().await;
}
