//! Servers are killed under a log.

use std::time::{Duration, Instant};

use mrol_cluster::JetStreamLog;
use mrol_service::replication::{NotPublished, ReplicatedLog};
use uuid::Uuid;

use crate::support::{NatsServers, Writer, changes, eventually, read_all};

#[test]
fn a_log_goes_on_while_one_server_of_three_is_killed_after_another() {
    let Some(mut servers) = NatsServers::start(3) else { return };
    let engine = servers.engine();
    let log = eventually(|| JetStreamLog::create(&engine, Uuid::new_v4()));
    let mut writer = Writer::new(&log);
    for index in 0..3 {
        let mut worst = Duration::ZERO;
        for message in 0..60 {
            if message == 20 {
                servers.kill(index);
            }
            let changes = changes(writer.position, 10_000);
            let begun = Instant::now();
            writer.publish_at_last(&changes);
            worst = worst.max(begun.elapsed());
        }
        println!("server {index} killed: the longest gap was {worst:?}");
        servers.start_one(index);
        // Until it has what it missed: another loss before would be the second at once.
        eventually(|| match servers.is_current(index) {
            true => Ok(()),
            false => Err("a server does not catch up"),
        });
    }
    assert_eq!(read_all(&log).0, writer.written);
}

#[test]
fn without_a_quorum_it_is_unknown_within_a_second_and_known_again_later() {
    let Some(mut servers) = NatsServers::start(3) else { return };
    let engine = servers.engine();
    let log = eventually(|| JetStreamLog::create(&engine, Uuid::new_v4()));
    let mut writer = Writer::new(&log);
    for _ in 0..5 {
        let message = changes(writer.position, 100);
        writer.publish_at_last(&message);
    }
    servers.kill(0);
    servers.kill(1);
    let message = changes(writer.position, 100);
    for _ in 0..6 {
        let begun = Instant::now();
        let outcome = log.publish(&message, writer.position);
        assert!(matches!(outcome, Err(NotPublished::Unknown(_))), "{outcome:?}");
        assert!(begun.elapsed() < Duration::from_secs(1), "{:?}", begun.elapsed());
        std::thread::sleep(Duration::from_millis(200));
    }
    servers.start_all();
    writer.publish_at_last(&message);
    writer.write(100).unwrap();
    assert_eq!(read_all(&log).0, writer.written);
}

#[test]
fn where_a_store_is_full_it_is_unknown_and_goes_on_once_there_is_space() {
    let Some(servers) = NatsServers::start_with(1, "", "max_file_store: 5000000") else { return };
    let engine = servers.engine();
    let log = JetStreamLog::create(&engine, Uuid::new_v4()).unwrap();
    let mut writer = Writer::new(&log);
    let outcome = loop {
        let message = changes(writer.position, 700_000);
        if let Err(error) = writer.publish(&message) {
            break error;
        }
    };
    let NotPublished::Unknown(text) = outcome else { panic!("refused") };
    assert!(text.contains("resource"), "{text}");
    assert!((5..=9).contains(&writer.written.len()), "{}", writer.written.len());
    log.cut_before(writer.position.sequence).unwrap();
    let message = changes(writer.position, 700_000);
    writer.publish_at_last(&message);
    assert_eq!(read_all(&log).0, writer.written[writer.written.len() - 2..]);
}

#[test]
fn a_log_that_was_killed_with_all_its_servers_is_there_again() {
    let Some(mut servers) = NatsServers::start(3) else { return };
    let engine = servers.engine();
    let log = eventually(|| JetStreamLog::create(&engine, Uuid::new_v4()));
    let mut writer = Writer::new(&log);
    for _ in 0..3 {
        let message = changes(writer.position, 100_000);
        writer.publish_at_last(&message);
        servers.kill_all();
        servers.start_all();
        let begun = Instant::now();
        let message = changes(writer.position, 100_000);
        writer.publish_at_last(&message);
        println!("all killed: acknowledged again after {:?}", begun.elapsed());
    }
    assert_eq!(read_all(&log).0, writer.written);
}
