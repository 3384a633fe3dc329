//! Clients that are given the addresses of several servers.

mod line;

use std::path::Path;
use std::time::{Duration, Instant};

use mrol::client::{Client, ClientError, Replica, ReplicaOptions};
use mrol::geometry::Point;
use mrol::map::{Lookup, MapName, RequestId};
use mrol::service::{Deletion, DeletionTarget, PointAnswer, PointCloud, PointQuery};

use crate::support::daemon::{Daemon, row, wait_until};
use line::Line;

/// A name that nothing else which is sent has in it.
const MAP: &str = "map-of-several";

fn map() -> MapName {
    MapName::new(MAP).unwrap()
}

/// The first point of a `row`.
fn first_point() -> PointCloud {
    points_at(row(1)[0])
}

fn points_at([x, y, z]: [f32; 3]) -> PointCloud {
    vec![Point::new(x, y, z)].into()
}

fn query(min_revision: Option<u64>) -> PointQuery {
    PointQuery {
        points: first_point(),
        map_from_points: None,
        level: 0,
        lookup: Lookup::Exact,
        min_revision,
        map_uuid: None,
        keep_out: false,
    }
}

async fn asked(client: &Client) -> Result<PointAnswer, ClientError> {
    client.query_points(&map(), query(None)).await
}

fn deletion(id: Option<&str>) -> Deletion {
    Deletion {
        target: DeletionTarget::Points(first_point()),
        level: 0,
        request_id: id.map(|id| RequestId::new(id).unwrap()),
    }
}

/// A server with a map of revision 1, and two lines to it, each of which is one address of a client.
async fn with_two_lines() -> (Daemon, Line, Line, Client) {
    let daemon = Daemon::start().await;
    daemon.make_map(MAP).await;
    daemon.put_in(MAP, &row(3)).await;
    let (first, second) = (Line::to(daemon.grpc).await, Line::to(daemon.grpc).await);
    let client = Client::connect(&format!("{}, http://{}", first.address, second.address)).await.unwrap();
    (daemon, first, second, client)
}

/// A server, and one with the same map a revision behind, which waits so long for a `min_revision`.
async fn with_one_behind(wait_max_s: f64) -> (Daemon, Daemon) {
    let daemon = Daemon::start().await;
    daemon.make_map(MAP).await;
    daemon.put_in(MAP, &row(3)).await;
    let former = daemon.stop().await;
    let copy = tempfile::tempdir().unwrap();
    copy_folder(former.path(), copy.path());
    let behind = Daemon::start_in(copy, |config| config.limits.min_revision_wait_max_s = wait_max_s).await;
    let ahead = Daemon::start_in(former, |_| ()).await;
    ahead.put_in(MAP, &row(5)).await;
    assert_eq!((ahead.contents(MAP).await.0, behind.contents(MAP).await.0), (2, 1));
    (ahead, behind)
}

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let (source, name) = entry.map(|entry| (entry.path(), entry.file_name())).unwrap();
        match source.is_dir() {
            true => copy_folder(&source, &to.join(name)),
            false => drop(std::fs::copy(&source, to.join(name)).unwrap()),
        }
    }
}

#[tokio::test]
async fn questions_go_on_elsewhere_when_a_server_is_gone_between_them() {
    let (_daemon, first, second, client) = with_two_lines().await;
    assert_eq!(asked(&client).await.unwrap().points_occupied, 1);
    assert_eq!(second.sent_bytes(), 0);
    first.cut().await;
    for _ in 0..3 {
        assert_eq!(asked(&client).await.unwrap().points_occupied, 1);
    }
    assert_eq!(client.list_maps().await.unwrap().maps.len(), 1);
    assert_eq!(client.trajectory(&map(), None).await.unwrap().poses.len(), 1);
    second.cut().await;
    // The last connection may be lost while it is used; then no address takes one.
    wait_until(async || {
        let gone = asked(&client).await.unwrap_err().to_string();
        gone.contains(&format!("cannot connect to http://{}, http://{}", first.address, second.address))
    })
    .await;
}

#[tokio::test]
async fn a_question_under_way_is_asked_elsewhere_when_its_server_goes() {
    let (_daemon, first, _second, client) = with_two_lines().await;
    first.mute();
    let asking = tokio::spawn({
        let client = client.clone();
        async move { (asked(&client).await, client.list_voxels(&map(), Default::default()).await) }
    });
    wait_until(async || first.times_sent(MAP) > 0).await;
    first.cut().await;
    let (points, listing) = asking.await.unwrap();
    assert_eq!(points.unwrap().points_occupied, 1);
    assert_eq!(listing.unwrap().voxels_total, 3);
}

#[tokio::test]
async fn a_server_that_answers_nothing_is_left_when_the_time_of_a_call_is_up() {
    let (_daemon, first, _second, client) = with_two_lines().await;
    let client = client.with_timeout(Duration::from_millis(300));
    first.mute();
    asked(&client).await.unwrap_err();
    assert_eq!(asked(&client).await.unwrap().points_occupied, 1);
}

#[tokio::test]
async fn a_server_that_answers_nothing_is_left_by_a_caller_that_waits_no_longer_than_the_deadline() {
    let (_daemon, first, _second, client) = with_two_lines().await;
    let deadline = Duration::from_millis(300);
    let client = client.with_timeout(deadline);
    first.mute();
    if let Ok(answer) = tokio::time::timeout(deadline, asked(&client)).await {
        answer.unwrap_err();
    }
    assert_eq!(asked(&client).await.unwrap().points_occupied, 1);
}

#[tokio::test]
async fn a_change_without_an_id_that_was_sent_is_lost_and_made_once() {
    let (daemon, first, second, client) = with_two_lines().await;
    first.mute();
    let changing = tokio::spawn({
        let client = client.clone();
        async move { client.delete_voxels(&map(), deletion(None)).await }
    });
    wait_until(async || daemon.contents(MAP).await.0 == 2).await;
    first.cut().await;
    let lost = changing.await.unwrap().unwrap_err();
    assert!(matches!(lost, ClientError::Lost { .. }), "{lost}");
    assert_eq!((second.sent_bytes(), daemon.contents(MAP).await.0), (0, 2));
    // Of one that cannot be sent there nothing was done, so that it is sent elsewhere.
    let other = Deletion { target: DeletionTarget::Points(points_at(row(2)[1])), ..deletion(None) };
    assert!(!client.delete_voxels(&map(), other).await.unwrap().replayed);
    assert!(second.sent_bytes() > 0);
}

#[tokio::test]
async fn a_change_without_an_id_goes_elsewhere_where_its_connection_was_gone_before() {
    let (daemon, first, second, client) = with_two_lines().await;
    first.cut().await;
    // Until the client has seen the end of its connection.
    tokio::time::sleep(Duration::from_millis(200)).await;
    let answer = client.delete_voxels(&map(), deletion(None)).await.unwrap();
    assert_eq!((answer.removed, answer.version.revision), (1, 2));
    assert!(second.sent_bytes() > 0);
    assert_eq!(daemon.contents(MAP).await.0, 2);
}

#[tokio::test]
async fn a_change_with_an_id_is_sent_again_and_made_once() {
    let (daemon, first, _second, client) = with_two_lines().await;
    first.mute();
    let changing = tokio::spawn({
        let client = client.clone();
        async move { client.delete_voxels(&map(), deletion(Some("once"))).await }
    });
    wait_until(async || daemon.contents(MAP).await.0 == 2).await;
    first.cut().await;
    let answer = changing.await.unwrap().unwrap();
    assert_eq!((answer.replayed, answer.removed, answer.version.revision), (true, 1, 2));
    assert_eq!(daemon.contents(MAP).await.0, 2);
}

#[tokio::test]
async fn a_change_that_was_lost_is_not_told_as_refused_by_another_server() {
    let (daemon, first, _second, _) = with_two_lines().await;
    let without_the_map = Daemon::start().await;
    let servers = format!("http://{},http://{}", first.address, without_the_map.grpc);
    let client = Client::connect(&servers).await.unwrap();
    first.mute();
    let changing = tokio::spawn({
        let client = client.clone();
        async move { client.delete_voxels(&map(), deletion(Some("d-1"))).await }
    });
    wait_until(async || daemon.contents(MAP).await.0 == 2).await;
    first.cut().await;
    let lost = changing.await.unwrap().unwrap_err();
    assert!(matches!(lost, ClientError::Lost { .. }), "{lost}");
}

#[tokio::test]
async fn a_stream_of_questions_begins_at_a_server_that_is_there() {
    let (_daemon, first, _second, client) = with_two_lines().await;
    first.cut().await;
    let batches = tokio_stream::iter([query(None), query(None)]);
    let mut answers = client.query_stream(&map(), batches).await.unwrap();
    for _ in 0..2 {
        assert_eq!(answers.next().await.unwrap().unwrap().points_occupied, 1);
    }
}

#[tokio::test]
async fn with_one_address_a_call_is_sent_as_it_is_and_once() {
    let (daemon, ..) = with_two_lines().await;
    let line = Line::to(daemon.grpc).await;
    let client = Client::connect(&format!("http://{}", line.address)).await.unwrap();
    let uuid = asked(&client).await.unwrap().version.map_uuid.to_string();
    asked(&client).await.unwrap();
    assert_eq!((line.times_sent(MAP), line.times_sent(&uuid)), (2, 0));
    line.mute();
    let asking = tokio::spawn(async move { asked(&client).await });
    wait_until(async || line.times_sent(MAP) == 3).await;
    line.cut().await;
    let lost = asking.await.unwrap().unwrap_err();
    assert!(matches!(lost, ClientError::Lost { .. }), "{lost}");
}

#[tokio::test]
async fn a_reader_never_sees_the_map_go_back_and_goes_on_once_the_other_server_is_as_far() {
    let (ahead, behind) = with_one_behind(0.3).await;
    let client = Client::connect(&format!("{},{}", ahead.grpc, behind.grpc)).await.unwrap();
    let told = asked(&client).await.unwrap().version;
    assert_eq!(told.revision, 2);
    ahead.stop().await;
    let late = asked(&client).await.unwrap_err();
    assert_eq!(late.reason(), Some("revision_not_reached"), "{late}");
    let stream = client.query_stream(&map(), tokio_stream::once(query(None))).await;
    let late = stream.unwrap().next().await.unwrap().unwrap_err();
    assert_eq!(late.reason(), Some("revision_not_reached"), "{late}");
    behind.put_in(MAP, &row(5)).await;
    let answer = asked(&client).await.unwrap().version;
    assert_eq!((answer.revision, answer.map_uuid), (2, told.map_uuid));
    // What the caller asks for counts where it is more.
    let late = client.query_points(&map(), query(Some(3))).await.unwrap_err();
    assert_eq!(late.reason(), Some("revision_not_reached"), "{late}");
}

#[tokio::test]
async fn a_map_that_was_made_again_starts_anew() {
    let (daemon, _first, _second, client) = with_two_lines().await;
    let former = asked(&client).await.unwrap().version;
    assert!(daemon.delete(&format!("/v1/maps/{MAP}")).await.status().is_success());
    daemon.make_map(MAP).await;
    let version = asked(&client).await.unwrap().version;
    assert_eq!(version.revision, 0);
    assert_ne!(version.map_uuid, former.map_uuid);
    // The caller hears of it where it asked for that map.
    let of_former = PointQuery { map_uuid: Some(former.map_uuid), ..query(None) };
    let replaced = client.query_points(&map(), of_former).await.unwrap_err();
    assert_eq!(replaced.reason(), Some("map_replaced"), "{replaced}");
}

#[tokio::test]
async fn a_replica_goes_on_elsewhere_without_a_step_back() {
    let (ahead, behind) = with_one_behind(10.0).await;
    let client = Client::connect(&format!("{},{}", ahead.grpc, behind.grpc)).await.unwrap();
    let replica = Replica::open(client, map(), ReplicaOptions::default()).await.unwrap();
    assert_eq!(replica.status().version.revision, 2);
    let mut statuses = replica.statuses();
    let revisions = tokio::spawn(async move {
        let mut revisions = vec![2];
        while revisions.last() != Some(&3) && statuses.changed().await.is_ok() {
            revisions.push(statuses.borrow_and_update().version.revision);
        }
        revisions
    });
    ahead.stop().await;
    tokio::time::sleep(Duration::from_millis(700)).await;
    behind.put_in(MAP, &row(5)).await;
    behind.put_in(MAP, &row(7)).await;
    replica.wait_for_revision(3, Duration::from_secs(10)).await.unwrap();
    // The state may have come again, but no older one.
    let revisions = revisions.await.unwrap();
    assert!(revisions.is_sorted(), "{revisions:?}");
}

#[tokio::test]
async fn an_address_that_takes_no_connection_costs_a_bounded_time() {
    let daemon = Daemon::start().await;
    // Once the queue of a listener that accepts nothing is full, nobody answers a connection.
    let socket = tokio::net::TcpSocket::new_v4().unwrap();
    socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let listener = socket.listen(1).unwrap();
    let hanging = listener.local_addr().unwrap();
    let mut waiting = Vec::new();
    for _ in 0..4 {
        let connecting = tokio::net::TcpStream::connect(hanging);
        waiting.push(tokio::time::timeout(Duration::from_millis(200), connecting).await);
    }
    let began = Instant::now();
    let client = Client::connect(&format!("{hanging},{}", daemon.grpc)).await.unwrap();
    assert!(began.elapsed() < Duration::from_secs(5), "{:?}", began.elapsed());
    let began = Instant::now();
    client.list_maps().await.unwrap();
    assert!(began.elapsed() < Duration::from_secs(1), "{:?}", began.elapsed());
}

#[tokio::test]
async fn each_address_of_a_list_has_to_be_one() {
    let bad = Client::connect("http://127.0.0.1:1,ftp://x").await.unwrap_err();
    assert!(matches!(&bad, ClientError::Url { url, .. } if url == "ftp://x"), "{bad}");
}
