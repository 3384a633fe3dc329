//! The body of every answer: it holds what its request holds until it is sent, and ends early where it must.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use axum::body::{Body, Bytes, HttpBody};
use axum::http::HeaderMap;
use hyper::body::{Frame, SizeHint};

use super::inbound_body::InboundBody;
use mrol_service::ServiceError;

/// Resolves when an answer must end, with the reason: its caller's key was withdrawn, its deadline is reached.
pub type Ending = Pin<Box<dyn Future<Output = ServiceError> + Send>>;

/// What ends an answer before it is sent in full.
pub struct Endings {
    /// The first that comes ends the answer.
    pub when: Vec<Ending>,
    /// What the protocol sends after what has been sent already: trailers, or nothing, so that its client sees the
    /// answer cut.
    pub trailers: fn(ServiceError) -> Option<HeaderMap>,
}

impl Endings {
    /// An answer that is sent in full.
    pub fn none() -> Self {
        Self { when: Vec::new(), trailers: |_| None }
    }
}

/// An answer goes to its connection in pieces of so many bytes. The connection asks for the next one when it has room,
/// so that the most of an answer that nobody reads lies here, where it counts.
const PIECE_BYTES: usize = 64 << 10;
/// Pieces below this size do not count any more once the connection has them. They are copied, so that nothing larger
/// is kept for them.
const COPIED_BYTES_MAX: usize = 16 << 10;

/// A body that holds the request that it answers, and `H`, until it was sent, or nobody takes it any more. When one of
/// its endings comes, nothing more of it goes out, and its maker is dropped.
pub(super) struct AnswerBody<H> {
    /// None when it has ended.
    body: Option<Body>,
    /// What came of `body` and was not asked for yet.
    rest: Bytes,
    held: Arc<Held<H>>,
    endings: Endings,
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

impl<H: Send + Sync + 'static> AnswerBody<H> {
    /// `body`, with what is dropped after it, and what may end it.
    pub(super) fn new(body: Body, answered: Option<InboundBody>, held: H, endings: Endings) -> Self {
        if let Some(answered) = &answered {
            answered.answer_waits();
        }
        let held = Arc::new(Held { answered, _held: held });
        Self { body: Some(body), rest: Bytes::new(), held, endings }
    }

    /// True of what goes out at once and in whole. It was allowed when it was made, and an ending in the moment between
    /// would leave the client without even a status.
    fn lies_ready(&self) -> bool {
        self.size_hint().exact().is_some_and(|bytes| bytes <= PIECE_BYTES as u64)
    }

    /// Why the answer ends now, if it does.
    fn poll_ended(&mut self, context: &mut Context<'_>) -> Option<ServiceError> {
        self.endings.when.iter_mut().find_map(|ending| match ending.as_mut().poll(context) {
            Poll::Ready(reason) => Some(reason),
            Poll::Pending => None,
        })
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

impl<H: Send + Sync + 'static> HttpBody for AnswerBody<H> {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if self.body.is_none() {
            return Poll::Ready(None);
        }
        let ended = if self.lies_ready() { None } else { self.poll_ended(context) };
        if let Some(reason) = ended {
            (self.body, self.rest) = (None, Bytes::new());
            let cut = axum::Error::new(reason.clone());
            return Poll::Ready(Some((self.endings.trailers)(reason).map(Frame::trailers).ok_or(cut)));
        }
        // It is asked for a piece when there is room for it on the way to the client.
        if let Some(answered) = &self.held.answered {
            answered.answer_is_read();
        }
        let piece = if self.rest.is_empty() {
            let Some(body) = &mut self.body else { return Poll::Ready(None) };
            match ready!(Pin::new(body).poll_frame(context)) {
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
        self.rest.is_empty() && self.body.as_ref().is_none_or(HttpBody::is_end_stream)
    }

    fn size_hint(&self) -> SizeHint {
        let of_body = self.body.as_ref().map(HttpBody::size_hint).unwrap_or_default();
        let rest = self.rest.len() as u64;
        let mut hint = SizeHint::new();
        hint.set_lower(of_body.lower() + rest);
        if let Some(upper) = of_body.upper() {
            hint.set_upper(upper + rest);
        }
        hint
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use http_body_util::BodyExt;
    use mrol_service::Reason;
    use tokio_stream::StreamExt;

    #[tokio::test]
    async fn an_answer_that_must_end_is_ended_with_its_maker() {
        let (alive, gone) = tokio::sync::oneshot::channel::<()>();
        let endless = tokio_stream::once(Ok::<_, axum::Error>(Bytes::from_static(b"a")));
        let endless = endless.chain(tokio_stream::pending().map(move |nothing| {
            let _ = &alive;
            nothing
        }));
        let (end, ended) = tokio::sync::oneshot::channel::<()>();
        let late = ServiceError::new(Reason::Deadline, "late");
        let when: Ending = Box::pin(async move {
            let _ = ended.await;
            late
        });
        let trailers =
            |_| Some(HeaderMap::from_iter([(axum::http::header::WARNING, "late".parse().unwrap())]));
        let endings = Endings { when: vec![Box::pin(std::future::pending()), when], trailers };
        let mut body = AnswerBody::new(Body::from_stream(endless), None, (), endings);
        assert_eq!(body.frame().await.unwrap().unwrap().into_data().unwrap(), "a");
        end.send(()).unwrap();
        let trailers = body.frame().await.unwrap().unwrap().into_trailers().unwrap();
        assert_eq!(trailers["warning"], "late");
        assert!(gone.await.is_err() && body.is_end_stream() && body.frame().await.is_none());
    }

    fn cut_at_once(body: Body) -> AnswerBody<()> {
        let cut: Ending = Box::pin(async { ServiceError::new(Reason::Draining, "cut") });
        AnswerBody::new(body, None, (), Endings { when: vec![cut], ..Endings::none() })
    }

    #[tokio::test]
    async fn an_answer_without_trailers_is_cut() {
        let mut body = cut_at_once(Body::from(vec![0; PIECE_BYTES + 1]));
        assert!(body.frame().await.unwrap().is_err() && body.frame().await.is_none());
    }

    #[tokio::test]
    async fn an_answer_that_lies_ready_is_sent_whole() {
        let mut body = cut_at_once(Body::from("whole"));
        assert_eq!(body.frame().await.unwrap().unwrap().into_data().unwrap(), "whole");
        assert!(body.is_end_stream());
    }
}
