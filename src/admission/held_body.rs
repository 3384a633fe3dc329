//! An answer that keeps something until it is sent.

use std::pin::Pin;
use std::task::{Context, Poll, ready};

use axum::body::{Body, Bytes, HttpBody};
use hyper::body::{Frame, SizeHint};

use super::arrival::Arrival;

/// A body that holds the request that it answers, and `H`, until it was sent, or nobody takes it any more.
#[derive(Debug)]
pub(super) struct HeldBody<H> {
    body: Body,
    answered: Option<Arrival>,
    _held: H,
}

impl<H> HeldBody<H> {
    /// `body`, with what is dropped after it.
    pub(super) fn new(body: Body, answered: Option<Arrival>, held: H) -> Self {
        if let Some(answered) = &answered {
            answered.answer_waits();
        }
        Self { body, answered, _held: held }
    }
}

impl<H: Unpin> HttpBody for HeldBody<H> {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        // It is asked for a piece when there is room for it on the way to the client.
        if let Some(answered) = &self.answered {
            answered.answer_is_read();
        }
        let piece = ready!(Pin::new(&mut self.body).poll_frame(context));
        if let Some(answered) = &self.answered {
            answered.answer_waits();
        }
        Poll::Ready(piece)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
