//! Keep-outs over both protocols: put, replaced, removed, expired, listed; regarded by queries and listings that ask
//! for it; told to who watches, kept across restarts, and of no concern to anything else.

mod changes;
mod expiry;
mod reads;
mod refused;
mod watched;

use std::time::{SystemTime, UNIX_EPOCH};

use mrol::client::Client;
use mrol::map::{KeepOutName, KeepOutShape, MapName, Region};
use mrol::service::PutKeepOut;
use serde_json::Value;

use crate::support::daemon::{Daemon, json_of, row};

fn map(name: &str) -> MapName {
    MapName::new(name).unwrap()
}

fn name(text: &str) -> KeepOutName {
    KeepOutName::new(text).unwrap()
}

fn ball(center_m: [f64; 3], radius_m: f64) -> KeepOutShape {
    KeepOutShape::of_region(Region::ball(center_m, radius_m).unwrap()).unwrap()
}

fn put(text: &str, shape: KeepOutShape) -> PutKeepOut {
    PutKeepOut { name: name(text), shape, expires_at_ns: None, request_id: None }
}

async fn client_of(daemon: &Daemon) -> Client {
    Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap()
}

fn now_ns() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as i64
}

/// A server with a map `a` of ten voxels in a row.
async fn started() -> Daemon {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(10)).await;
    daemon
}

async fn listed(daemon: &Daemon) -> Value {
    json_of(daemon.get("/v1/maps/a/keep-outs").await).await
}

async fn names(daemon: &Daemon) -> Vec<String> {
    let all = listed(daemon).await["keep_outs"].as_array().unwrap().clone();
    all.iter().map(|keep_out| keep_out["name"].as_str().unwrap().to_owned()).collect()
}

const ROUTE: &str = "/v1/maps/a/keep-outs";
