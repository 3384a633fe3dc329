//! An answer that keeps something until it is sent.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use axum::body::{Body, Bytes, HttpBody};
use hyper::body::{Frame, SizeHint};

use super::inbound_body::InboundBody;

/// An answer goes to its connection in pieces of so many bytes. The connection asks for the next one when it has room,
/// so that the most of an answer that nobody reads lies here, where it counts.
const PIECE_BYTES: usize = 64 << 10;
/// Pieces below this size do not count any more once the connection has them. They are copied, so that nothing larger is
/// kept for them.
const COPIED_BYTES_MAX: usize = 16 << 10;

/// A body that holds the request that it answers, and `H`, until it was sent, or nobody takes it any more.
#[derive(Debug)]
pub(super) struct HeldBody<H> {
    body: Body,
    /// What came of `body` and was not asked for yet.
    rest: Bytes,
    held: Arc<Held<H>>,
}

#[derive(Debug)]
struct Held<H> {
    answered: Option<InboundBody>,
    _held: H,
}

/// A piece of an answer that is held as long as the connection has the piece.
struct HeldPiece<H> {
    piece: Bytes,
    _held: Arc<Held<H>>,
}

impl<H> AsRef<[u8]> for HeldPiece<H> {
    fn as_ref(&self) -> &[u8] {
        &self.piece
    }
}

impl<H: Send + Sync + 'static> HeldBody<H> {
    /// `body`, with what is dropped after it.
    pub(super) fn new(body: Body, answered: Option<InboundBody>, held: H) -> Self {
        if let Some(answered) = &answered {
            answered.answer_waits();
        }
        Self { body, rest: Bytes::new(), held: Arc::new(Held { answered, _held: held }) }
    }

    fn next_piece(&mut self) -> Frame<Bytes> {
        let piece = self.rest.split_to(self.rest.len().min(PIECE_BYTES));
        Frame::data(if piece.len() < COPIED_BYTES_MAX {
            Bytes::copy_from_slice(&piece)
        } else {
            Bytes::from_owner(HeldPiece { piece, _held: Arc::clone(&self.held) })
        })
    }
}

impl<H: Send + Sync + 'static> HttpBody for HeldBody<H> {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        // It is asked for a piece when there is room for it on the way to the client.
        if let Some(answered) = &self.held.answered {
            answered.answer_is_read();
        }
        let piece = if self.rest.is_empty() {
            match ready!(Pin::new(&mut self.body).poll_frame(context)) {
                Some(Ok(frame)) => Some(frame.into_data().map_or_else(Ok, |data| {
                    self.rest = data;
                    Ok(self.next_piece())
                })),
                other => other,
            }
        } else {
            Some(Ok(self.next_piece()))
        };
        if let Some(answered) = &self.held.answered {
            answered.answer_waits();
        }
        Poll::Ready(piece)
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty() && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        let (of_body, rest) = (self.body.size_hint(), self.rest.len() as u64);
        let mut hint = SizeHint::new();
        hint.set_lower(of_body.lower() + rest);
        if let Some(upper) = of_body.upper() {
            hint.set_upper(upper + rest);
        }
        hint
    }
}
