//! Older copies of all stores are put back, and the log goes on from there.

use mrol_cluster::JetStreamLog;
use mrol_service::replication::{LogError, NotPublished, ReplicatedLog};
use uuid::Uuid;

use crate::support::{NatsServers, Writer, changes, eventually, read_all};

fn what_an_older_copy_has_not_is_refused(count: usize) {
    let Some(mut servers) = NatsServers::start(count) else { return };
    let engine = servers.engine();
    let log = eventually(|| JetStreamLog::create(&engine, Uuid::new_v4()));
    let mut writer = Writer::new(&log);
    for _ in 0..5 {
        let message = changes(writer.position, 1_000);
        writer.publish_at_last(&message);
    }
    let kept = writer.position;
    servers.kill_all();
    let copy = servers.copy_stores();
    servers.start_all();
    for _ in 0..5 {
        let message = changes(writer.position, 1_000);
        writer.publish_at_last(&message);
    }
    servers.kill_all();
    servers.put_back_stores(&copy);
    servers.start_all();

    let refused = |position| {
        let message = changes(position, 1_000);
        eventually(|| match log.publish(&message, position) {
            Err(NotPublished::Refused) => Ok(()),
            Err(error) => Err(error.to_string()),
            Ok(()) => panic!("published behind what is lost"),
        });
    };
    let unknown = |position| {
        eventually(|| match log.read_behind(position) {
            Err(LogError::NoSuchPosition) => Ok(()),
            Err(error) => Err(error.to_string()),
            Ok(entries) => panic!("{entries:?} behind what is lost"),
        });
    };
    let lost = writer.position;
    refused(lost);
    unknown(lost);

    // Another writer goes on from the copy's end, up to the same number: the ids differ.
    let mut other = Writer::new(&log);
    other.position = kept;
    for _ in 0..5 {
        let message = changes(other.position, 1_000);
        other.publish_at_last(&message);
    }
    assert_eq!(other.position.sequence, lost.sequence);
    refused(lost);
    unknown(lost);
    unknown(writer.written[7].position());
    let expected: Vec<_> = writer.written[..5].iter().chain(&other.written).cloned().collect();
    assert_eq!(read_all(&log).0, expected);
    other.write(1_000).unwrap();
}

#[test]
fn what_an_older_copy_of_one_server_has_not_is_refused_and_no_position() {
    what_an_older_copy_has_not_is_refused(1);
}

#[test]
fn what_an_older_copy_of_three_servers_has_not_is_refused_and_no_position() {
    what_an_older_copy_has_not_is_refused(3);
}
