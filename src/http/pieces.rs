//! JSON of which most is one array, written in pieces: such an answer may be larger than any other.

use std::convert::Infallible;

use axum::body::{Body, Bytes};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Serialize;

use crate::admission::MemoryPermit;
use mrol_service::{Reason, ServiceError};

/// How an array is written.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pieces {
    /// The array's name in the object.
    pub(super) field: &'static str,
    /// Items that are written at once.
    pub(super) items: usize,
    /// Bytes of an item with its comma, at most.
    pub(super) item_bytes: usize,
}

impl Pieces {
    /// `{<head>,"<field>":[...]}` with an array of `count` items, each of which `write` appends to the text: in pieces, each made
    /// when it is asked for.
    ///
    /// # Errors
    /// `Internal` where the head cannot be written.
    pub(super) fn of<H: Serialize, W: Fn(&mut String, usize) + Send>(
        self,
        head: &H,
        count: usize,
        write: W,
    ) -> Result<impl Iterator<Item = String> + Send + use<H, W>, ServiceError> {
        let head = serde_json::to_string(head)
            .map_err(|error| ServiceError::new(Reason::NotWritten, error.to_string()))?;
        let first = format!("{},\"{}\":[", head.trim_end_matches('}'), self.field);
        let pieces = (0..count).step_by(self.items).map(move |start| {
            let end = count.min(start + self.items);
            let mut text = String::with_capacity((end - start) * self.item_bytes);
            for item in start..end {
                if item > 0 {
                    text.push(',');
                }
                write(&mut text, item);
            }
            text
        });
        Ok(std::iter::once(first).chain(pieces).chain(std::iter::once("]}".to_owned())))
    }

    /// Bytes of memory that the text of `count` items takes until it is sent: two pieces, one that is made and one that is sent.
    pub(super) fn bytes(&self, count: usize) -> usize {
        2 * count.min(self.items) * self.item_bytes
    }
}

/// The answer that the pieces are, which keeps `kept` until it is sent.
pub(super) fn response(
    pieces: impl Iterator<Item = String> + Send + 'static,
    kept: MemoryPermit,
) -> Response {
    let pieces = pieces.map(move |piece| {
        let _until_sent = &kept;
        Ok::<_, Infallible>(Bytes::from(piece))
    });
    let body = Body::from_stream(tokio_stream::iter(pieces));
    ([(header::CONTENT_TYPE, "application/json")], body).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pieces_are_one_json_object() {
        #[derive(Serialize)]
        struct Head {
            level: u32,
        }
        let all = Pieces { field: "all", items: 3, item_bytes: 2 };
        for count in [0, 1, 2, 3, 4, 7] {
            let write = |text: &mut String, item: usize| text.push_str(&item.to_string());
            let pieces: Vec<_> = all.of(&Head { level: 3 }, count, write).unwrap().collect();
            assert_eq!(pieces.len(), 2 + count.div_ceil(3));
            assert!(pieces.iter().skip(1).all(|piece| 2 * piece.len() <= all.bytes(count).max(4)));
            let json: serde_json::Value = serde_json::from_str(&pieces.concat()).unwrap();
            let expected: Vec<_> = (0..count).collect();
            assert_eq!(json, serde_json::json!({"level": 3, "all": expected}));
        }
    }
}
