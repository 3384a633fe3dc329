//! An answer on its way out.

use std::pin::Pin;
use std::task::{Context, Poll, ready};

use axum::body::{Body, Bytes, HttpBody};
use hyper::body::{Frame, SizeHint};

use super::connection_slots::InUse;

/// A body that keeps its connection in use until it is sent, and tells whether the client reads it: the next piece is
/// asked for when there is room for it on the way.
pub(super) struct TrackedBody {
    body: Body,
    used: InUse,
}

impl TrackedBody {
    pub(super) fn new(body: Body, used: InUse) -> Self {
        // A client that leaves no room for the first piece does not read either.
        used.handed_over();
        Self { body, used }
    }
}

impl HttpBody for TrackedBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        self.used.read();
        let piece = ready!(Pin::new(&mut self.body).poll_frame(context));
        self.used.handed_over();
        Poll::Ready(piece)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
