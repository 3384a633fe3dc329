//! Reading what is behind a position.

use std::time::Duration;

use mrol_service::replication::{Entry, LogError, Position};
use serde::Serialize;

use super::headers::entry_of;
use super::leader::{certain_view, view};
use super::names::LogNames;
use crate::engine::{BatchMessage, CallError, Engine};

/// Messages that are read at once: of the smallest, half a megabyte.
const MESSAGES_MAX: u32 = 1_000;
/// Bytes that are read at once, though one message may be more: enough for five of the largest.
const BYTES_MAX: u32 = 4 << 20;
/// How long each message may take.
const WITHIN: Duration = Duration::from_millis(500);

/// Reads the messages directly behind a position, from one replica.
pub(super) async fn read_behind(
    engine: &Engine,
    names: &LogNames,
    position: Position,
) -> Result<Vec<Entry>, LogError> {
    #[derive(Serialize)]
    struct Question {
        seq: u64,
        batch: u32,
        max_bytes: u32,
    }
    let question = Question { seq: position.sequence + 1, batch: MESSAGES_MAX, max_bytes: BYTES_MAX };
    let found = engine.batch(&names.stream, &question, WITHIN).await;
    let found = found.map_err(|error| LogError::Unavailable(error.to_string()))?;
    let entries = entries_of(found, names)?;
    match entries.first() {
        Some(first) if follows(first, position) => chain(entries, names),
        None if position.sequence == 0 => Ok(entries),
        None => confirm(engine, names, position).await.map(|()| entries),
        Some(_) => {
            confirm(engine, names, position).await?;
            let stream = &names.stream;
            Err(LogError::Unavailable(format!("stream {stream}: a replica differs from its leader's")))
        }
    }
}

/// Messages up to the first that is none of the log, which is an error where it is the first.
fn entries_of(found: Vec<BatchMessage>, names: &LogNames) -> Result<Vec<Entry>, LogError> {
    let mut entries = Vec::with_capacity(found.len());
    for message in found {
        match entry_of(message) {
            Ok(entry) => entries.push(entry),
            Err(_) if !entries.is_empty() => break,
            Err(error) => return Err(LogError::Unavailable(format!("stream {}: {error}", names.stream))),
        }
    }
    Ok(entries)
}

/// True of the message directly behind a position. Each names the one before it, so the position is checked without
/// reading that again, and may itself have been cut; before the first is any that the stream begins with.
fn follows(entry: &Entry, position: Position) -> bool {
    position.sequence == 0 || (entry.sequence == position.sequence + 1 && entry.message.after == position.id)
}

/// The messages, if each follows the one before it.
fn chain(entries: Vec<Entry>, names: &LogNames) -> Result<Vec<Entry>, LogError> {
    let broken = entries.windows(2).find(|pair| !follows(&pair[1], pair[0].position()));
    match broken {
        None => Ok(entries),
        Some(pair) => {
            let (stream, sequence) = (&names.stream, pair[1].sequence);
            let text = format!("stream {stream}: message {sequence} does not name the one before it");
            Err(LogError::Unavailable(text))
        }
    }
}

/// Makes sure that the stream has a position, of which the replica that was read knows nothing, or something else.
async fn confirm(engine: &Engine, names: &LogNames, position: Position) -> Result<(), LogError> {
    let asked = async {
        match view(engine, names, position).await? {
            leader if leader.holds => Ok(Some(leader)),
            _ => certain_view(engine, names, position).await,
        }
    };
    let unavailable = |text: &str| Err(LogError::Unavailable(format!("stream {}: {text}", names.stream)));
    match tokio::time::timeout(WITHIN, asked).await {
        Ok(Ok(Some(leader))) if leader.holds => Ok(()),
        Ok(Ok(Some(_))) => Err(LogError::NoSuchPosition),
        Ok(Ok(None)) => unavailable("no leader knows of all messages"),
        Ok(Err(error)) => unavailable(&CallError::to_string(&error)),
        Err(_) => unavailable("its leader does not answer"),
    }
}
