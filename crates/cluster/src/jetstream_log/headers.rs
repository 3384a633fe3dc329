//! Messages of the log as headers and payload of a message of NATS.

use std::str::FromStr;

use async_nats::HeaderMap;
use mrol_map::map::StateHash;
use mrol_service::replication::{Body, Changes, Entry, Message, NodeName, Piece};
use uuid::Uuid;

use crate::engine::BatchMessage;

const ID: &str = "Nats-Msg-Id";
const AFTER: &str = "Mrol-After";
const EPOCH: &str = "Mrol-Epoch";
const CLAIM: &str = "Mrol-Claim";
const FIRST: &str = "Mrol-First";
const LAST: &str = "Mrol-Last";
const STATE_BEFORE: &str = "Mrol-State-Before";
const PIECE: &str = "Mrol-Piece";

/// Why a message of the stream is none of the log.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("message {sequence} is not one of a map's log: header {header} is {found}")]
pub(super) struct MalformedMessage {
    sequence: u64,
    header: &'static str,
    found: String,
}

/// The headers of a message; its payload is its frames.
pub(super) fn headers_of(message: &Message) -> HeaderMap {
    let mut headers = HeaderMap::new();
    headers.insert(ID, message.id.to_string());
    headers.insert(EPOCH, message.epoch.to_string());
    if let Some(after) = message.after {
        headers.insert(AFTER, after.to_string());
    }
    match &message.body {
        Body::Claim(node) => headers.insert(CLAIM, node.as_str()),
        Body::Changes(changes) => {
            headers.insert(FIRST, changes.first.to_string());
            headers.insert(LAST, changes.last.to_string());
            if let Some(state) = changes.state_before {
                headers.insert(STATE_BEFORE, state.to_string());
            }
            headers.insert(PIECE, format!("{}/{}", changes.piece.index + 1, changes.piece.of));
        }
    }
    headers
}

/// Reads a message of the stream.
pub(super) fn entry_of(found: BatchMessage) -> Result<Entry, MalformedMessage> {
    let fields = Fields { sequence: found.sequence, headers: &found.headers };
    let body = match fields.text(CLAIM) {
        Some(node) => Body::Claim(NodeName::new(node).map_err(|_| fields.malformed(CLAIM))?),
        None => Body::Changes(Changes {
            first: fields.parsed(FIRST)?,
            last: fields.parsed(LAST)?,
            state_before: fields.state_before()?,
            piece: fields.piece()?,
            frames: found.payload,
        }),
    };
    let after = fields.text(AFTER).map(|_| fields.parsed::<Uuid>(AFTER)).transpose()?;
    let message = Message { id: fields.parsed(ID)?, after, epoch: fields.parsed(EPOCH)?, body };
    Ok(Entry { sequence: found.sequence, message })
}

/// The headers of a message that is read.
struct Fields<'a> {
    sequence: u64,
    headers: &'a HeaderMap,
}

impl<'a> Fields<'a> {
    fn text(&self, header: &'static str) -> Option<&'a str> {
        self.headers.get(header).map(|value| value.as_str())
    }

    fn malformed(&self, header: &'static str) -> MalformedMessage {
        let found = self.text(header).map_or_else(|| "missing".to_owned(), |text| format!("{text:?}"));
        MalformedMessage { sequence: self.sequence, header, found }
    }

    fn parsed<T: FromStr>(&self, header: &'static str) -> Result<T, MalformedMessage> {
        self.text(header).and_then(|text| text.parse().ok()).ok_or_else(|| self.malformed(header))
    }

    /// Sixteen hexadecimal digits, or nothing.
    fn state_before(&self) -> Result<Option<StateHash>, MalformedMessage> {
        let Some(text) = self.text(STATE_BEFORE) else { return Ok(None) };
        let bits = Some(text).filter(|text| text.len() == 16).map(|text| u64::from_str_radix(text, 16));
        let Some(Ok(bits)) = bits else { return Err(self.malformed(STATE_BEFORE)) };
        Ok(Some(StateHash::from_bits(bits)))
    }

    /// Such as `2/3`: the second of three.
    fn piece(&self) -> Result<Piece, MalformedMessage> {
        let parts = self.text(PIECE).and_then(|text| text.split_once('/'));
        let parsed = parts.and_then(|(number, of)| Some((number.parse::<u32>().ok()?, of.parse().ok()?)));
        match parsed {
            Some((number, of)) if number >= 1 && number <= of => Ok(Piece { index: number - 1, of }),
            _ => Err(self.malformed(PIECE)),
        }
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    fn changes() -> Message {
        let piece = Piece { index: 1, of: 3 };
        let state_before = Some(StateHash::from_bits(0x1f));
        let changes =
            Changes { first: 7, last: 9, state_before, piece, frames: Bytes::from_static(b"frames") };
        Message {
            id: Uuid::from_u128(1),
            after: Some(Uuid::from_u128(2)),
            epoch: 4,
            body: Body::Changes(changes),
        }
    }

    fn read(headers: HeaderMap, payload: &'static [u8]) -> Result<Entry, MalformedMessage> {
        entry_of(BatchMessage { sequence: 5, headers, payload: payload.into() })
    }

    #[test]
    fn a_message_is_read_as_it_was_written() {
        let claim = Message {
            id: Uuid::from_u128(1),
            after: None,
            epoch: 1,
            body: Body::Claim(NodeName::new("a").unwrap()),
        };
        assert_eq!(read(headers_of(&claim), b"").unwrap(), Entry { sequence: 5, message: claim });
        assert_eq!(
            read(headers_of(&changes()), b"frames").unwrap(),
            Entry { sequence: 5, message: changes() }
        );
    }

    #[track_caller]
    fn check_malformed(header: &'static str, value: &str, said: &str) {
        let mut headers = headers_of(&changes());
        headers.insert(header, value);
        let error = read(headers, b"").unwrap_err().to_string();
        assert_eq!(error, format!("message 5 is not one of a map's log: header {header} is {said}"));
    }

    #[test]
    fn a_message_that_is_none_of_the_log_names_the_header() {
        check_malformed(PIECE, "0/3", "\"0/3\"");
        check_malformed(PIECE, "4/3", "\"4/3\"");
        check_malformed(PIECE, "2", "\"2\"");
        check_malformed(STATE_BEFORE, "1f", "\"1f\"");
        check_malformed(EPOCH, "-1", "\"-1\"");
        check_malformed(ID, "x", "\"x\"");
        check_malformed(AFTER, "x", "\"x\"");
        check_malformed(CLAIM, "A", "\"A\"");
        let error = read(HeaderMap::new(), b"").unwrap_err();
        assert_eq!(error.to_string(), "message 5 is not one of a map's log: header Mrol-First is missing");
    }
}
