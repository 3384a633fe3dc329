//! A body that is counted as it arrives.

use std::pin::Pin;
use std::task::{Context, Poll, ready};

use axum::body::{Body, Bytes, HttpBody};
use hyper::body::{Frame, SizeHint};
use tokio_util::sync::WaitForCancellationFutureOwned;

use super::inbound_body::InboundBody;
use mrol_service::ServiceError;

/// A request's body: each piece is counted when it has come, and the end is noted.
pub(super) struct MeteredBody {
    body: Body,
    arrival: InboundBody,
    /// True while the reader waits for a piece that has not come.
    awaited: bool,
    ended: Pin<Box<WaitForCancellationFutureOwned>>,
}

type Piece = Option<Result<Frame<Bytes>, axum::Error>>;

impl MeteredBody {
    pub(super) fn new(body: Body, arrival: InboundBody) -> Self {
        let ended = Box::pin(arrival.ended().cancelled_owned());
        Self { body, arrival, awaited: false, ended }
    }

    fn counted(&self, piece: Piece) -> Result<Piece, ServiceError> {
        if let Some(Ok(frame)) = &piece {
            self.arrival.add(frame.data_ref().map_or(0, Bytes::len))?;
        }
        // Some readers do not ask again after the last piece.
        if piece.is_none() || self.body.is_end_stream() {
            self.arrival.complete()?;
        }
        Ok(piece)
    }
}

impl HttpBody for MeteredBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Piece> {
        let refused = |refusal: ServiceError| Poll::Ready(Some(Err(axum::Error::new(refusal))));
        if self.ended.as_mut().poll(context).is_ready()
            && let Some(refusal) = self.arrival.refusal()
        {
            return refused(refusal);
        }
        if !self.awaited {
            self.arrival.await_more();
            self.awaited = true;
        }
        let piece = ready!(Pin::new(&mut self.body).poll_frame(context));
        self.awaited = false;
        self.counted(piece).map_or_else(refused, Poll::Ready)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
