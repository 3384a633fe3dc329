//! Servers are killed at random under several writers.

use std::collections::HashMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use mrol_cluster::{Engine, JetStreamLog};
use mrol_service::replication::{LogError, NotPublished, Position, ReplicatedLog};
use uuid::Uuid;

use crate::support::{NatsServers, changes, eventually, read_all};

/// For how long servers are killed, in seconds, in place of the fifteen of the gate. 110 took 40 kills.
const SECONDS: &str = "MROL_CLUSTER_KILLS_S";

/// What became of the messages of all writers.
#[derive(Default)]
struct Outcomes {
    acknowledged: Mutex<HashMap<Uuid, u64>>,
    refused: Mutex<Vec<Uuid>>,
}

/// Writes behind what it has read until it is stopped, and reads on where another was faster.
fn write(engine: &Engine, map: Uuid, outcomes: &Outcomes, is_stopped: &AtomicBool) {
    let log = eventually(|| JetStreamLog::open(engine, map));
    let mut position = Position::default();
    while !is_stopped.load(Ordering::Relaxed) {
        let message = changes(position, 2_000);
        let is_acknowledged = loop {
            match log.publish(&message, position) {
                Ok(()) => break true,
                Err(NotPublished::Refused) => break false,
                Err(NotPublished::Unknown(_)) => std::thread::sleep(Duration::from_millis(5)),
            }
        };
        if is_acknowledged {
            position = Position { sequence: position.sequence + 1, id: Some(message.id) };
            outcomes.acknowledged.lock().unwrap().insert(message.id, position.sequence);
            std::thread::sleep(Duration::from_millis(3));
        } else {
            outcomes.refused.lock().unwrap().push(message.id);
            position = end_behind(&log, position);
        }
    }
}

/// The end of a log that has this position.
fn end_behind(log: &JetStreamLog, mut position: Position) -> Position {
    loop {
        match log.read_behind(position) {
            Ok(entries) => match entries.last() {
                Some(last) => position = last.position(),
                None => return position,
            },
            Err(LogError::NoSuchPosition) => panic!("{position:?} was acknowledged or read"),
            Err(LogError::Unavailable(_)) => std::thread::sleep(Duration::from_millis(5)),
        }
    }
}

/// Kills one, two or all of three servers and starts them again, until the time is over.
fn kill(servers: &mut NatsServers, time: Duration) -> usize {
    let (begun, mut kills) = (Instant::now(), 0);
    let roll = |below: u64| u64::from_le_bytes(Uuid::new_v4().as_bytes()[8..].try_into().unwrap()) % below;
    while begun.elapsed() < time {
        std::thread::sleep(Duration::from_millis(500 + roll(2_500)));
        let (count, first) = (1 + roll(3) as usize, roll(3) as usize);
        (0..count).for_each(|next| servers.kill((first + next) % 3));
        std::thread::sleep(Duration::from_millis(roll(4_000)));
        servers.start_all();
        kills += count;
    }
    kills
}

#[test]
fn while_servers_are_killed_what_is_acknowledged_is_kept_once_and_what_is_refused_never() {
    let Some(mut servers) = NatsServers::start(3) else { return };
    let seconds = std::env::var(SECONDS).map_or(15, |seconds| seconds.parse().unwrap());
    let (map, engine) = (Uuid::new_v4(), servers.engine());
    let log = eventually(|| JetStreamLog::create(&engine, map));
    let engines: Vec<_> = (0..4).map(|_| servers.engine()).collect();
    let (outcomes, is_stopped) = (Outcomes::default(), AtomicBool::new(false));
    let kills = std::thread::scope(|scope| {
        for engine in &engines {
            scope.spawn(|| write(engine, map, &outcomes, &is_stopped));
        }
        let kills = kill(&mut servers, Duration::from_secs(seconds));
        let all_are_current = || (0..3).all(|index| servers.is_current(index));
        eventually(|| all_are_current().then_some(()).ok_or("a server does not catch up"));
        is_stopped.store(true, Ordering::Relaxed);
        kills
    });

    let (entries, _) = read_all(&log);
    let kept: HashMap<_, _> = entries.iter().map(|entry| (entry.message.id, entry.sequence)).collect();
    let acknowledged = outcomes.acknowledged.into_inner().unwrap();
    let refused = outcomes.refused.into_inner().unwrap();
    println!("{kills} kills: {} acknowledged, {} refused", acknowledged.len(), refused.len());
    assert_eq!(kept.len(), entries.len(), "a message is there twice");
    let is_kept = |(id, sequence): (&Uuid, &u64)| kept.get(id) == Some(sequence);
    assert!(acknowledged.iter().all(is_kept), "an acknowledged message is lost");
    assert!(!refused.iter().any(|id| kept.contains_key(id)), "a refused message is there");
}
