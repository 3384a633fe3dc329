//! Questions of planners: the same answers over gRPC, over HTTP in both forms, and from a replica.

mod alike;
mod floor;
mod keep_outs;
mod part_of_a_map;
mod refused;
mod streams;
mod tiles;
mod unknown;
mod versions;

use std::sync::Arc;

use mrol::client::{Client, Replica, ReplicaOptions};
use mrol::map::{KeepOutName, KeepOutShape, MapName, Region};
use mrol::planning::{Body, Link, Sphere, Surroundings};
use mrol::service::{CheckAs, PoseCheck, PutKeepOut, Question, QuestionScope};
use serde_json::Value;

use crate::support::daemon::{Daemon, row};

fn map() -> MapName {
    MapName::new("a").unwrap()
}

/// A server with a row of twenty voxels of 0.1 m along x, a client of it, and a replica.
async fn row_of_voxels() -> (Daemon, Client, Replica) {
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &row(20)).await;
    let client = Client::connect(&format!("http://{}", daemon.grpc)).await.unwrap();
    let replica = Replica::open(client.clone(), map(), ReplicaOptions::default()).await.unwrap();
    (daemon, client, replica)
}

fn ball(radius_m: f32) -> Arc<Body> {
    let spheres = vec![Sphere { center_m: [0.0; 3], radius_m }];
    Arc::new(Body::new(vec![Link { spheres, ..Link::default() }]).unwrap())
}

fn at(x: f32, y: f32, z: f32) -> [f32; 7] {
    [x, y, z, 0.0, 0.0, 0.0, 1.0]
}

fn poses(answer: CheckAs) -> PoseCheck {
    let configurations = [at(0.55, 0.4, 0.05), at(0.55, 0.2, 0.05), at(-5.0, 0.0, 0.0)].concat();
    let (asked, surroundings) = (QuestionScope::default(), Surroundings::default());
    PoseCheck { asked, body: ball(0.15), configurations, surroundings, answer }
}

/// Bodies of requests in the form for programs.
fn framed(head: &Value, arrays: &[u8]) -> Vec<u8> {
    let head = serde_json::to_vec(head).unwrap();
    [&(head.len() as u32).to_le_bytes()[..], &head, arrays].concat()
}

/// The head and the arrays of an answer in the form for programs.
fn parts(body: &[u8]) -> (Value, &[u8]) {
    let length = u32::from_le_bytes(body[..4].try_into().unwrap()) as usize;
    (serde_json::from_slice(&body[4..4 + length]).unwrap(), &body[4 + length..])
}

fn array<'a>(head: &Value, arrays: &'a [u8], name: &str) -> &'a [u8] {
    let [at, bytes] = ["at", "bytes"].map(|field| head[name][field].as_u64().unwrap() as usize);
    &arrays[at..at + bytes]
}

fn same<Q: Question>(replica: &Replica, question: &Q, told: &mrol::service::AtVersion<Q::Answer>)
where
    Q::Answer: PartialEq,
{
    let own = replica.ask(question).unwrap();
    assert_eq!((&own.answer, own.version), (&told.answer, told.version));
}

/// A server with the row, and a crate: a box from y = 1 to 2 along all of the row.
async fn row_and_crate() -> (Daemon, Client, Replica) {
    let (daemon, client, replica) = row_of_voxels().await;
    let shape = KeepOutShape::of_region(Region::cuboid([0.0, 1.0, 0.0], [2.0, 2.0, 0.5]).unwrap()).unwrap();
    let name = KeepOutName::new("crate").unwrap();
    let put = PutKeepOut { name, shape, expires_at_ns: None, request_id: None };
    let revision = client.put_keep_out(&map(), put).await.unwrap().version.revision;
    replica.wait_for_revision(revision, std::time::Duration::from_secs(20)).await.unwrap();
    (daemon, client, replica)
}

/// The same question without keep-outs.
fn but_keep_outs() -> QuestionScope {
    QuestionScope { ignore_keep_outs: true, ..QuestionScope::default() }
}
