//! Publishing: by compare-and-set on the number and the id of the last message.

use std::time::{Duration, Instant};

use async_nats::HeaderMap;
use bytes::Bytes;
use mrol_service::replication::{Body, Message, NotPublished, Position};
use serde::Deserialize;

use super::headers::headers_of;
use super::leader::{certain_view, id_at};
use super::names::LogNames;
use crate::engine::{ApiError, CallError, Engine, read_answer};

/// Bytes of frames that a message may hold. NATS takes messages of 1 MiB by default, headers included.
pub const FRAMES_MAX: usize = 768 << 10;

/// How long an attempt waits. Three servers acknowledged 700 kB after 7 ms as a rule, and of a hundred the slowest
/// after 115; a leader that does not answer for so long is as good as gone.
const ATTEMPT_MAX: Duration = Duration::from_millis(500);

/// The stream's last sequence, as the writer knows it.
const EXPECTED_LAST: &str = "Nats-Expected-Last-Sequence";
/// The last sequence of a subject, as the writer knows it.
const EXPECTED_LAST_OF_SUBJECT: &str = "Nats-Expected-Last-Subject-Sequence";
/// Which subject: that of the message before, of which there is one at most.
const EXPECTED_LAST_SUBJECT: &str = "Nats-Expected-Last-Subject-Sequence-Subject";

#[derive(Deserialize)]
struct Acknowledgment {
    seq: u64,
}

/// Publishes a message directly behind a position. Takes an attempt, and as long again where it is to be found out what
/// came of one before.
pub(super) async fn publish(
    engine: &Engine,
    names: &LogNames,
    message: &Message,
    position: Position,
) -> Result<(), NotPublished> {
    let payload = match &message.body {
        Body::Claim(_) => Bytes::new(),
        Body::Changes(changes) => changes.frames.clone(),
    };
    let mut headers = headers_of(message);
    expect(&mut headers, names, position);
    let begun = Instant::now();
    let answer = engine.request(&names.subject(message.id), headers, payload, ATTEMPT_MAX).await;
    let answer = answer.map_err(|error| NotPublished::Unknown(error.to_string()))?;
    match read_answer::<Acknowledgment>(&answer.payload) {
        Ok(acknowledged) => {
            engine.note_acknowledgment(begun.elapsed());
            at(acknowledged.seq, names, message, position)
        }
        Err(CallError::Api(error)) if error.is_wrong_last_sequence() || error.is_id_in_process() => {
            let settled = settle(engine, names, message, position, &error);
            let late = |_| Err(NotPublished::Unknown(format!("{error}; and what is there was not answered")));
            tokio::time::timeout(ATTEMPT_MAX, settled).await.unwrap_or_else(late)
        }
        Err(error) => Err(NotPublished::Unknown(error.to_string())),
    }
}

/// Demands that the stream ends at the position.
fn expect(headers: &mut HeaderMap, names: &LogNames, position: Position) {
    headers.insert(EXPECTED_LAST, position.sequence.to_string());
    if let Some(id) = position.id {
        headers.insert(EXPECTED_LAST_OF_SUBJECT, position.sequence.to_string());
        headers.insert(EXPECTED_LAST_SUBJECT, names.subject(id));
    }
}

/// A message is kept under this number.
fn at(sequence: u64, names: &LogNames, message: &Message, position: Position) -> Result<(), NotPublished> {
    if sequence == position.sequence + 1 {
        return Ok(());
    }
    let (stream, id) = (&names.stream, message.id);
    tracing::error!(stream, %id, sequence, behind = position.sequence, "a message is at another place of its log");
    Err(NotPublished::Refused)
}

/// Says what it means that the stream did not end at the position: that this message is there from an attempt before,
/// that another is, that one is on its way, or that the position is lost.
async fn settle(
    engine: &Engine,
    names: &LogNames,
    message: &Message,
    position: Position,
    said: &ApiError,
) -> Result<(), NotPublished> {
    let unknown = |error: CallError| NotPublished::Unknown(error.to_string());
    match id_at(engine, names, position.sequence + 1).await.map_err(unknown)? {
        Some(id) if id == Some(message.id) => return Ok(()),
        Some(_) => return Err(NotPublished::Refused),
        // "In process" is no refusal.
        None if said.is_id_in_process() => return Err(NotPublished::Unknown(said.to_string())),
        None => {}
    }
    let text = match certain_view(engine, names, position).await.map_err(unknown)? {
        None => "the stream has no leader that knows of all messages",
        Some(leader) if leader.last_sequence > position.sequence => {
            "another message came to the same place of the log, or that was cut"
        }
        Some(leader) if leader.holds && is_there(engine, names, position).await.map_err(unknown)? => {
            "another message is on its way to the same place of the log"
        }
        Some(_) => return Err(NotPublished::Refused),
    };
    Err(NotPublished::Unknown(text.to_owned()))
}

/// True where the message at the position has this number too, and for the position before all.
async fn is_there(engine: &Engine, names: &LogNames, position: Position) -> Result<bool, CallError> {
    match position.id {
        None => Ok(position.sequence == 0),
        id => Ok(id_at(engine, names, position.sequence).await? == Some(id)),
    }
}
