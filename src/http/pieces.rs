//! JSON of which most is one array, written in pieces: such an answer may be larger than any other.

use axum::body::{Body, Bytes};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use tokio::sync::mpsc;
use tokio_stream::StreamExt;
use tokio_stream::wrappers::ReceiverStream;

use super::error::HttpError;
use crate::admission::{MemoryPermit, off_runtime};
use mrol_service::{MapService, Reason, ServiceError};

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
    /// `{<head>,"<field>":[...]}` with an array of `count` items, each of which `write` appends to the text: in pieces,
    /// each made when it is asked for.
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

    /// Bytes of memory that the text of `count` items takes until it is sent: three pieces, one that is made, one that
    /// waits and one that is sent.
    pub(super) fn bytes(&self, count: usize) -> usize {
        3 * count.min(self.items) * self.item_bytes
    }
}

/// The answer that the pieces are, which keeps `kept` until it is sent. Each is written in the turn of the caller of
/// `service`, one ahead of the one that is sent.
pub(super) fn response(
    service: &MapService,
    mut pieces: impl Iterator<Item = String> + Send + 'static,
    kept: MemoryPermit,
) -> Response {
    let (service, (outbox, written)) = (service.clone(), mpsc::channel(1));
    tokio::spawn(async move {
        loop {
            let made = service.convert(move || (pieces.next(), pieces)).await;
            // What fails on the way breaks the answer off.
            let (piece, rest) = match made {
                Ok((piece, rest)) => (piece.map(Ok), Some(rest)),
                Err(error) => (Some(Err(error)), None),
            };
            let Some(piece) = piece else { return };
            if outbox.send(piece).await.is_err() {
                return;
            }
            let Some(rest) = rest else { return };
            pieces = rest;
        }
    });
    let written = ReceiverStream::new(written).map(move |piece| {
        let _until_sent = &kept;
        piece.map(Bytes::from)
    });
    ([(header::CONTENT_TYPE, "application/json")], Body::from_stream(written)).into_response()
}

/// An answer of JSON of about so many bytes: a large one is written in the turn of the caller of `service`.
///
/// # Errors
/// `Internal` where it cannot be written.
pub(super) async fn whole<T: Serialize>(
    service: &MapService,
    bytes: usize,
    make: impl FnOnce() -> T + Send + 'static,
) -> Result<Response, HttpError> {
    let write = move || serde_json::to_vec(&make());
    let written = off_runtime(service, bytes, (), write).await?;
    let text = written.map_err(|error| ServiceError::new(Reason::NotWritten, error.to_string()))?;
    Ok(([(header::CONTENT_TYPE, "application/json")], text).into_response())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_service::{Limits, ServiceSettings};
    use mrol_store::OpeningProgress;

    #[tokio::test]
    async fn pieces_are_written_on_no_thread_of_the_runtime() {
        let service = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        let admission = crate::admission::Admission::new(&Limits::default(), Default::default());
        let all = Pieces { field: "all", items: 2, item_bytes: 3 };
        let write = |text: &mut String, item: usize| {
            let thread = std::thread::current();
            assert!(thread.name().unwrap().starts_with("mrol-message-"), "{thread:?}");
            text.push_str(&item.to_string());
        };
        let pieces = all.of(&serde_json::json!({"level": 3}), 7, write).unwrap();
        let answer = response(&service, pieces, admission.keep(0).unwrap());
        let body = axum::body::to_bytes(answer.into_body(), 1000).await.unwrap();
        assert_eq!(body, r#"{"level":3,"all":[0,1,2,3,4,5,6]}"#);
    }

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
            assert!(pieces.iter().skip(1).all(|piece| 3 * piece.len() <= all.bytes(count).max(6)));
            let json: serde_json::Value = serde_json::from_str(&pieces.concat()).unwrap();
            let expected: Vec<_> = (0..count).collect();
            assert_eq!(json, serde_json::json!({"level": 3, "all": expected}));
        }
    }
}
