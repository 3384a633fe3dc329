//! A message is published directly behind the position that its writer knows, or not at all.

use std::sync::Barrier;
use std::time::Duration;

use mrol_cluster::JetStreamLog;
use mrol_service::replication::{NotPublished, Position, ReplicatedLog};
use uuid::Uuid;

use crate::support::{NatsServers, Writer, changes, claim, read_all};

/// A test of a log on so many servers.
fn with_log(servers: usize, test: impl FnOnce(&JetStreamLog)) {
    let Some(servers) = NatsServers::start(servers) else { return };
    let engine = servers.engine();
    let log = crate::support::eventually(|| JetStreamLog::create(&engine, Uuid::new_v4()));
    test(&log);
}

fn claims_and_changes_are_read_as_published(log: &JetStreamLog) {
    let mut writer = Writer::new(log);
    let claim = claim(writer.position, "node-1");
    writer.publish_at_last(&claim);
    for bytes in [0, 1, 700_000, 768 << 10, 60_000] {
        let message = changes(writer.position, bytes);
        writer.publish_at_last(&message);
    }
    assert_eq!(read_all(log).0, writer.written);
}

#[test]
fn claims_and_changes_are_read_as_published_from_one_server() {
    with_log(1, claims_and_changes_are_read_as_published);
}

#[test]
fn claims_and_changes_are_read_as_published_from_three_servers() {
    with_log(3, claims_and_changes_are_read_as_published);
}

fn of_eight_writers_one_wins(log: &JetStreamLog) {
    let mut position = Position::default();
    for round in 0..50 {
        let barrier = Barrier::new(8);
        let outcomes: Vec<_> = std::thread::scope(|scope| {
            let writers: Vec<_> = (0..8)
                .map(|writer| {
                    let barrier = &barrier;
                    scope.spawn(move || {
                        let message = claim(position, &format!("node-{writer}"));
                        barrier.wait();
                        // What is not known yet is asked again, as a node does.
                        let outcome = loop {
                            match log.publish(&message, position) {
                                Err(NotPublished::Unknown(_)) => {}
                                known => break known,
                            }
                        };
                        (message, outcome)
                    })
                })
                .collect();
            writers.into_iter().map(|writer| writer.join().unwrap()).collect()
        });
        let winners: Vec<_> = outcomes.iter().filter(|(_, outcome)| outcome.is_ok()).collect();
        assert_eq!(winners.len(), 1, "round {round}: {outcomes:?}");
        position = Position { sequence: position.sequence + 1, id: Some(winners[0].0.id) };
        let (entries, _) = read_all(log);
        assert_eq!(entries.last().map(|entry| entry.position()), Some(position), "round {round}");
    }
}

#[test]
fn of_eight_writers_at_one_place_of_one_server_one_wins() {
    with_log(1, of_eight_writers_one_wins);
}

#[test]
fn of_eight_writers_at_one_place_of_three_servers_one_wins() {
    with_log(3, of_eight_writers_one_wins);
}

fn a_wrong_position_is_refused(log: &JetStreamLog) {
    let mut writer = Writer::new(log);
    for _ in 0..3 {
        let message = changes(writer.position, 100);
        writer.publish_at_last(&message);
    }
    let (before, last) = (writer.written[1].position(), writer.position);
    let ahead = Position { sequence: 9, id: last.id };
    let other_id = Position { sequence: last.sequence, id: Some(Uuid::new_v4()) };
    let older_id = Position { sequence: last.sequence, id: before.id };
    for position in [Position::default(), before, ahead, other_id, older_id] {
        let refused = log.publish(&changes(position, 100), position);
        assert_eq!(refused, Err(NotPublished::Refused), "{position:?}");
    }
    // Nothing of it stops the log.
    writer.write(100).unwrap();
    assert_eq!(read_all(log).0, writer.written);
}

#[test]
fn a_wrong_number_or_id_is_refused_by_one_server() {
    with_log(1, a_wrong_position_is_refused);
}

#[test]
fn a_wrong_number_or_id_is_refused_by_three_servers() {
    with_log(3, a_wrong_position_is_refused);
}

fn repeated_messages_are_acknowledged_again(log: &JetStreamLog) {
    let mut writer = Writer::new(log);
    let first = changes(writer.position, 700_000);
    writer.publish_at_last(&first);
    let position = writer.position;
    let message = changes(position, 700_000);
    writer.publish_at_last(&message);
    assert_eq!(log.publish(&message, position), Ok(()), "at once");
    std::thread::sleep(Duration::from_secs(3));
    assert_eq!(log.publish(&message, position), Ok(()), "after ids are forgotten");
    writer.write(100).unwrap();
    assert_eq!(log.publish(&message, position), Ok(()), "after another message");
    assert_eq!(log.publish(&first, Position::default()), Ok(()), "the first");
    assert_eq!(read_all(log).0, writer.written);
}

#[test]
fn a_message_whose_acknowledgment_was_lost_is_acknowledged_again_by_one_server() {
    with_log(1, repeated_messages_are_acknowledged_again);
}

#[test]
fn a_message_whose_acknowledgment_was_lost_is_acknowledged_again_by_three_servers() {
    with_log(3, repeated_messages_are_acknowledged_again);
}

#[test]
fn a_log_of_which_nobody_knows_is_not_refused() {
    with_log(1, |log| {
        let other = Uuid::new_v4();
        assert!(JetStreamLog::open(log.engine(), other).is_err());
        let made = JetStreamLog::create(log.engine(), other).unwrap();
        JetStreamLog::delete(log.engine(), other).unwrap();
        JetStreamLog::delete(log.engine(), other).unwrap();
        let position = Position::default();
        let outcome = made.publish(&changes(position, 1), position);
        assert!(matches!(outcome, Err(NotPublished::Unknown(_))), "{outcome:?}");
    });
}
