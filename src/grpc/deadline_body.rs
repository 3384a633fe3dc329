//! An answer that ends with its call's deadline, whether the client still takes it or not.

use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes, HttpBody};
use axum::http::HeaderMap;
use axum::response::Response;
use hyper::body::{Frame, SizeHint};
use tokio::time::{Sleep, sleep_until};
use tonic::Status;

use crate::service::ServiceError;

/// A body that goes, with whoever makes it, when the time is up; the call's status says so.
pub(super) struct DeadlineBody {
    /// None when it has ended.
    body: Option<Body>,
    /// What its status says then.
    late: ServiceError,
    reached: Pin<Box<Sleep>>,
}

impl DeadlineBody {
    /// The same response, of a call that began at `begin` and ends with `late`.
    pub(super) fn wrap(
        response: Response,
        deadline: Duration,
        begin: Instant,
        late: ServiceError,
    ) -> Response {
        // A deadline beyond all time is none.
        let Some(end) = begin.checked_add(deadline) else { return response };
        let reached = Box::pin(sleep_until(end.into()));
        response.map(|body| Body::new(Self { body: Some(body), late, reached }))
    }

    fn late(&self) -> HeaderMap {
        let mut trailers = HeaderMap::new();
        // Without a status the client takes the call for cut, which it is.
        let _ = Status::from(self.late.clone()).add_header(&mut trailers);
        trailers
    }
}

impl HttpBody for DeadlineBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let Some(body) = &mut self.body else { return Poll::Ready(None) };
        if let Poll::Ready(frame) = Pin::new(body).poll_frame(context) {
            return Poll::Ready(frame);
        }
        if self.reached.as_mut().poll(context).is_pending() {
            return Poll::Pending;
        }
        self.body = None;
        Poll::Ready(Some(Ok(Frame::trailers(self.late()))))
    }

    fn is_end_stream(&self) -> bool {
        self.body.as_ref().is_none_or(HttpBody::is_end_stream)
    }

    fn size_hint(&self) -> SizeHint {
        self.body.as_ref().map(HttpBody::size_hint).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use http_body_util::BodyExt;
    use tokio_stream::StreamExt;

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_goes_on_beyond_the_deadline_is_ended_with_its_status() {
        let (alive, gone) = tokio::sync::oneshot::channel::<()>();
        let endless = tokio_stream::once(Ok::<_, axum::Error>(Bytes::from_static(b"a")));
        let endless = endless.chain(tokio_stream::pending().map(move |nothing| {
            let _ = &alive;
            nothing
        }));
        let response = Response::new(Body::from_stream(endless));
        let deadline = Duration::from_secs(3);
        let begin = tokio::time::Instant::now().into_std();
        let response =
            DeadlineBody::wrap(response, deadline, begin, crate::grpc::deadline::reached(deadline));
        let sent = response.into_body().collect().await.unwrap();
        let trailers = sent.trailers().unwrap();
        assert_eq!(trailers["grpc-status"], "4");
        assert_eq!(trailers["mrol-reason"], "deadline");
        assert_eq!(sent.to_bytes(), "a");
        assert!(gone.await.is_err());
    }
}
