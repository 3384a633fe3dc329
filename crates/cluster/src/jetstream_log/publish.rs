//! Publishing: by compare-and-set on the number and the id of the last message.

use std::time::Duration;

use async_nats::HeaderMap;
use bytes::Bytes;
use mrol_service::replication::{Body, Message, NotPublished, Position};
use serde::Deserialize;

use super::headers::headers_of;
use super::leader::{sequence_of, view};
use super::names::LogNames;
use crate::engine::{CallError, Engine, read_answer};

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

/// Publishes a message directly behind a position.
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
    let answer = engine.request(&names.subject(message.id), headers, payload, ATTEMPT_MAX).await;
    let answer = answer.map_err(|error| NotPublished::Unknown(error.to_string()))?;
    match read_answer::<Acknowledgment>(&answer.payload) {
        Ok(acknowledged) => at(acknowledged.seq, names, message, position),
        Err(CallError::Api(error)) if error.is_wrong_last_sequence() => {
            settle(engine, names, message, position).await
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
/// that another is, or that one is on its way.
async fn settle(
    engine: &Engine,
    names: &LogNames,
    message: &Message,
    position: Position,
) -> Result<(), NotPublished> {
    let unknown = |error: CallError| NotPublished::Unknown(error.to_string());
    // The end first: what is there now is found by the second question too.
    let leader = view(engine, names, position).await.map_err(unknown)?;
    if let Some(sequence) = sequence_of(engine, names, message.id).await.map_err(unknown)? {
        return at(sequence, names, message, position);
    }
    if !leader.is_certain {
        let text = "the leader of the stream is cut off from most of its replicas";
        return Err(NotPublished::Unknown(text.to_owned()));
    }
    let is_last = leader.holds && leader.last_sequence == position.sequence;
    if is_last && is_there(engine, names, position).await.map_err(unknown)? {
        let text = "another message is on its way to the same place of the log";
        return Err(NotPublished::Unknown(text.to_owned()));
    }
    Err(NotPublished::Refused)
}

/// True where the message at the position has this number too, and for the position before all.
async fn is_there(engine: &Engine, names: &LogNames, position: Position) -> Result<bool, CallError> {
    match position.id {
        None => Ok(position.sequence == 0),
        Some(id) => Ok(sequence_of(engine, names, id).await? == Some(position.sequence)),
    }
}
